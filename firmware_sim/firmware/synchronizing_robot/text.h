/* text.h: names of robots and links in the text of an event. */
#ifndef TEXT_H
#define TEXT_H

#include <stdint.h>
#include "marconet_text.h"
#include "team.h"

/* Add a robot's name. */
void text_robot(Text *text, uint32_t robot);

/* Add the links in words, robots numbered from 1. */
void text_links(Text *text, const Team *team, const Robots *heard);

#endif
