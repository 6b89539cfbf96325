/* text.c: see text.h. */
#include "text.h"
#include "marconet_functions.h"
#include "marconet_numbers.h"

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

void text_whole(Text *text, int64_t number)
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

/* Return size * 10^exponent, for sizes and results within the range of a double. */
static double scaled(double size, int32_t exponent)
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

static double upper_half(double value) { return 134217729.0 * value - (134217729.0 * value - value); }

/* Return a * b - product, where `product` is a * b rounded (Dekker 1971). */
static double lost_by(double a, double b, double product)
{
    const double a1 = upper_half(a), a2 = a - a1, b1 = upper_half(b), b2 = b - b1;
    return ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2;
}

/* Return size * 10^exponent, rounded to a whole number. What the product lost decides if it lies halfway between two. */
static int64_t digits_of(double size, int32_t exponent)
{
    const double product = scaled(size, exponent);
    const int64_t below = (int64_t)product;
    const double lost = 0 < exponent && exponent <= 22 ? lost_by(size, scaled(1.0, exponent), product) : 0.0;
    if (product - (double)below == 0.5 && lost != 0.0) {
        return lost > 0.0 ? below + 1 : below;
    }
    return rounded(product);
}

/* Add `whole` digits, a point and the other ones of `count`, without zeros at the end of the fraction. */
static void significant(Text *text, const char *digits, int32_t whole, int32_t count)
{
    while (count > whole && digits[count - 1] == '0') {
        count--;
    }
    for (int32_t k = 0; k < whole || k < count; k++) {
        if (k == whole) {
            letter(text, '.');
        }
        letter(text, digits[k]);
    }
}

void text_real(Text *text, double number, uint32_t digits)
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
        letter(text, '-');
    }
    for (int32_t k = 0; k < count; k++) {
        limit *= 10;
    }
    if (!(size > 1e-290)) {             /* events have no smaller numbers */
        letter(text, '0');
        return;
    }
    exponent = (int32_t)((double)((int32_t)(bits_of(size) >> 52) - 1023) * 0.30103);
    while (scaled(size, -exponent) >= 10.0) {
        exponent++;
    }
    while (scaled(size, -exponent) < 1.0) {
        exponent--;
    }
    int64_t value = digits_of(size, count - 1 - exponent);
    if (value >= limit) {
        value /= 10;
        exponent++;
    }
    for (int32_t k = count - 1; k >= 0; k--) {
        digit[k] = (char)('0' + value % 10);
        value /= 10;
    }
    if (exponent < -4 || exponent >= count) {
        significant(text, digit, 1, count);
        text_add(text, exponent < 0 ? "e-" : "e+");
        exponent = exponent < 0 ? -exponent : exponent;
        text_add(text, exponent < 10 ? "0" : "");
        text_whole(text, exponent);
    } else if (exponent < 0) {
        text_add(text, "0.");
        for (int32_t k = -1; k > exponent; k--) {
            letter(text, '0');
        }
        int32_t last = count;
        while (last > 1 && digit[last - 1] == '0') {
            last--;
        }
        for (int32_t k = 0; k < last; k++) {
            letter(text, digit[k]);
        }
    } else {
        significant(text, digit, exponent + 1, count);
    }
}
