/* marconet_text.h: the text of an event, built piece by piece; what does not fit is cut. A header of plain C without a
 * library. */
#ifndef MARCONET_TEXT_H
#define MARCONET_TEXT_H

#include <stdint.h>
#include "marconet_board.h"
#include "marconet_functions.h"
#include "marconet_numbers.h"

#if defined(__GNUC__)
#define TEXT_FUNCTION static __attribute__((noinline, unused))      /* texts are rare, and flash is short */
#else
#define TEXT_FUNCTION static inline
#endif

typedef struct {
    char letters[BOARD_MAX_DETAIL_BYTES + 1];
    uint32_t length;
} Text;

TEXT_FUNCTION void text_letter(Text *text, char added)
{
    if (text->length < BOARD_MAX_DETAIL_BYTES) {
        text->letters[text->length++] = added;
        text->letters[text->length] = '\0';
    }
}

TEXT_FUNCTION void text_begin(Text *text)
{
    text->length = 0;
    text->letters[0] = '\0';
}

TEXT_FUNCTION void text_add(Text *text, const char *more)
{
    for (; *more != '\0'; more++) {
        text_letter(text, *more);
    }
}

TEXT_FUNCTION void text_number(Text *text, int64_t number)
{
    char digits[20];
    uint32_t count = 0;
    uint64_t rest = number < 0 ? 0u - (uint64_t)number : (uint64_t)number;
    do {
        digits[count++] = (char)('0' + rest % 10u);
        rest /= 10u;
    } while (rest > 0);
    if (number < 0) {
        text_letter(text, '-');
    }
    while (count > 0) {
        text_letter(text, digits[--count]);
    }
}

/* Return size * 10^exponent, for sizes and results within the range of a double. */
TEXT_FUNCTION double text_scaled(double size, int32_t exponent)
{
    double power = 1.0;
    for (int32_t k = exponent < 0 ? -exponent : exponent; k > 0; k--) {
        power *= 10.0;                  /* exact up to 10^22 */
        if (k % 22 == 1) {
            size = exponent < 0 ? size / power : size * power;
            power = 1.0;
        }
    }
    return size;
}

static inline double text_upper_half(double value) { return 134217729.0 * value - (134217729.0 * value - value); }

/* Return a * b - product, where `product` is a * b rounded (Dekker 1971). */
TEXT_FUNCTION double text_lost_by(double a, double b, double product)
{
    const double a1 = text_upper_half(a), a2 = a - a1, b1 = text_upper_half(b), b2 = b - b1;
    return ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2;
}

/* Return size * 10^exponent, rounded to a whole number. What the product lost decides if it lies halfway between two. */
TEXT_FUNCTION int64_t text_digits(double size, int32_t exponent)
{
    const double product = text_scaled(size, exponent);
    const int64_t below = (int64_t)product;
    const double lost = 0 < exponent && exponent <= 22 ? text_lost_by(size, text_scaled(1.0, exponent), product) : 0.0;
    if (product - (double)below == 0.5 && lost != 0.0) {
        return lost > 0.0 ? below + 1 : below;
    }
    return rounded(product);
}

/* Add `whole` digits, a point and the other ones of `count`, without zeros at the end of the fraction. */
TEXT_FUNCTION void text_significant(Text *text, const char *digits, int32_t whole, int32_t count)
{
    while (count > whole && digits[count - 1] == '0') {
        count--;
    }
    for (int32_t k = 0; k < whole || k < count; k++) {
        if (k == whole) {
            text_letter(text, '.');
        }
        text_letter(text, digits[k]);
    }
}

/* Add a number with `digits` significant digits, 1 to 15, as C's %g does. */
TEXT_FUNCTION void text_real(Text *text, double number, uint32_t digits)
{
    const double size = magnitude(number);
    const int32_t count = (int32_t)digits;
    char digit[16];
    int32_t exponent = 0;
    int64_t limit = 1;
    if (!(size <= 1.7976931348623157e308)) {
        text_add(text, number != number ? "nan" : number < 0.0 ? "-inf" : "inf");
        return;
    }
    if (number < 0.0) {
        text_letter(text, '-');
    }
    for (int32_t k = 0; k < count; k++) {
        limit *= 10;
    }
    if (!(size > 1e-290)) {             /* events have no smaller numbers */
        text_letter(text, '0');
        return;
    }
    exponent = (int32_t)((double)((int32_t)(bits_of(size) >> 52) - 1023) * 0.30103);
    while (text_scaled(size, -exponent) >= 10.0) {
        exponent++;
    }
    while (text_scaled(size, -exponent) < 1.0) {
        exponent--;
    }
    int64_t value = text_digits(size, count - 1 - exponent);
    if (value >= limit) {
        value /= 10;
        exponent++;
    }
    for (int32_t k = count - 1; k >= 0; k--) {
        digit[k] = (char)('0' + value % 10);
        value /= 10;
    }
    if (exponent < -4 || exponent >= count) {
        text_significant(text, digit, 1, count);
        text_add(text, exponent < 0 ? "e-" : "e+");
        exponent = exponent < 0 ? -exponent : exponent;
        text_add(text, exponent < 10 ? "0" : "");
        text_number(text, exponent);
    } else if (exponent < 0) {
        text_add(text, "0.");
        for (int32_t k = -1; k > exponent; k--) {
            text_letter(text, '0');
        }
        int32_t last = count;
        while (last > 1 && digit[last - 1] == '0') {
            last--;
        }
        for (int32_t k = 0; k < last; k++) {
            text_letter(text, digit[k]);
        }
    } else {
        text_significant(text, digit, exponent + 1, count);
    }
}

#endif
