/* text.h: the text of an event, built piece by piece; what does not fit is cut. */
#ifndef TEXT_H
#define TEXT_H

#include <stdint.h>
#include "marconet_board.h"

typedef struct {
    char letters[BOARD_MAX_DETAIL_BYTES + 1];
    uint32_t length;
} Text;

void text_begin(Text *text);
void text_add(Text *text, const char *more);
void text_whole(Text *text, int64_t number);

/* Add a number with `digits` significant digits, 1 to 15, as C's %g does. */
void text_real(Text *text, double number, uint32_t digits);

#endif
