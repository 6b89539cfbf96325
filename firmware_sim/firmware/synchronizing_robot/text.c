/* text.c: see text.h. */
#include "text.h"
#include "board_ids.h"

void text_robot(Text *text, uint32_t robot)
{
    double byte;
    uint32_t at = 0;
    for (; board_parameter(PARAMETER_NAMES, at, &byte) == BOARD_OK; at++) {
        if (byte == 0.0) {
            if (robot-- == 0) {
                return;
            }
        } else if (robot == 0) {
            text_letter(text, (char)(uint8_t)byte);
        }
    }
}

void text_links(Text *text, const Team *team, const Robots *heard)
{
    for (uint32_t i = 0; i < team->robots; i++) {
        text_add(text, i > 0 ? "; " : "");
        text_number(text, i + 1);
        text_add(text, heard[i] == 0 ? " hears nobody" : " hears ");
        const char *between = "";
        for (uint32_t j = 0; j < team->robots; j++) {
            if (HAS(heard[i], j)) {
                text_add(text, between);
                text_number(text, j + 1);
                between = ",";
            }
        }
    }
}
