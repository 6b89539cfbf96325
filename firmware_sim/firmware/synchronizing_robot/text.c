/* text.c: see text.h. */
#include "text.h"
#include "board_ids.h"

static void letter(Text *text, char added)
{
    if (text->length < BOARD_MAX_DETAIL_BYTES) {
        text->letters[text->length++] = added;
        text->letters[text->length] = '\0';
    }
}

void text_begin(Text *text)
{
    text->length = 0;
    text->letters[0] = '\0';
}

void text_add(Text *text, const char *more)
{
    for (; *more != '\0'; more++) {
        letter(text, *more);
    }
}

void text_number(Text *text, int64_t number)
{
    char digits[20];
    uint32_t count = 0;
    uint64_t rest = number < 0 ? 0u - (uint64_t)number : (uint64_t)number;
    do {
        digits[count++] = (char)('0' + rest % 10u);
        rest /= 10u;
    } while (rest > 0);
    if (number < 0) {
        letter(text, '-');
    }
    while (count > 0) {
        letter(text, digits[--count]);
    }
}

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
            letter(text, (char)(uint8_t)byte);
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
