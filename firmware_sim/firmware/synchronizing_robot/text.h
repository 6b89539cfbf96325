/* text.h: the text of an event, built piece by piece; what does not fit is cut. */
#ifndef TEXT_H
#define TEXT_H

#include <stdint.h>
#include "marconet_board.h"
#include "team.h"

typedef struct {
    char letters[BOARD_MAX_DETAIL_BYTES + 1];
    uint32_t length;
} Text;

void text_begin(Text *text);
void text_add(Text *text, const char *more);
void text_number(Text *text, int64_t number);

/* Add a robot's name. */
void text_robot(Text *text, uint32_t robot);

/* Add the links in words, robots numbered from 1. */
void text_links(Text *text, const Team *team, const Robots *heard);

#endif
