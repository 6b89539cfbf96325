/* motor.c: registers of a motor's electronics: quadrature encoders and PWM stages.
 *
 *     count = (floor(angle / 2 pi * counts per revolution) + offset) mod (reload + 1)        as captured
 *     mean output = full scale * min(compare, period) / period, 0 while off, negative while reversed
 *
 * The plant gets the mean output at once. Not modelled: ripple, dead time, the two tracks of an encoder, its index.
 */
#include "machine.h"
#include <math.h>

enum {
    ENCODER_CAPTURE = 0x00, ENCODER_COUNT = 0x04, ENCODER_RELOAD = 0x08, ENCODER_REVOLUTION = 0x0C, ENCODER_DOWN = 0x10,
    PWM_PERIOD = 0x00, PWM_COMPARE = 0x04, PWM_CONTROL = 0x08,
    PWM_ON = 1, PWM_REVERSE = 2,
    STRIDE = 0x20
};
#define GREATEST_COUNT 9e15                     /* a double holds whole numbers up to here */
#define TURN 6.283185307179586                  /* [rad] */

static uint32_t counted(const EncoderState *encoder)
{
    const int64_t range = (int64_t)encoder->reload + 1;
    return (uint32_t)(((encoder->turned + encoder->offset) % range + range) % range);
}

uint32_t read_encoder(Machine *m, uint32_t offset)
{
    const uint32_t number = offset / STRIDE;
    const EncoderState *encoder = &m->state.encoder[number % MOTORS];
    if (number < m->encoders) {
        switch (offset % STRIDE) {
        case ENCODER_COUNT: return counted(encoder);
        case ENCODER_RELOAD: return encoder->reload;
        case ENCODER_REVOLUTION: return m->counts_per_revolution[number];
        case ENCODER_DOWN: return encoder->down;
        default: break;
        }
    }
    trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + 0x5000u + offset);
    return 0;
}

void write_encoder(Machine *m, uint32_t offset, uint32_t value)
{
    const uint32_t number = offset / STRIDE;
    EncoderState *encoder = &m->state.encoder[number % MOTORS];
    if (number < m->encoders) {
        switch (offset % STRIDE) {
        case ENCODER_CAPTURE:
            m->state.encoder_asked = number;
            request(m, ENCODER, number, 0, 0.0);
            return;
        case ENCODER_COUNT: encoder->offset = (int64_t)value - encoder->turned; return;
        case ENCODER_RELOAD: encoder->reload = value; return;
        default: break;
        }
    }
    trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + 0x5000u + offset);
}

void capture_encoder(Machine *m, double angle)
{
    const uint32_t number = m->state.encoder_asked;
    EncoderState *encoder = &m->state.encoder[number];
    const double counts = floor(angle / TURN * m->counts_per_revolution[number]);
    if (fabs(counts) < GREATEST_COUNT) {        /* false for a number that is none */
        encoder->down = (int64_t)counts < encoder->turned || (encoder->down && (int64_t)counts == encoder->turned);
        encoder->turned = (int64_t)counts;
    }
}

uint32_t read_pwm(Machine *m, uint32_t offset)
{
    const uint32_t number = offset / STRIDE;
    const PwmState *pwm = &m->state.pwm[number % MOTORS];
    if (number < m->pwms) {
        switch (offset % STRIDE) {
        case PWM_PERIOD: return pwm->period;
        case PWM_COMPARE: return pwm->compare;
        case PWM_CONTROL: return pwm->control;
        default: break;
        }
    }
    trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + 0x6000u + offset);
    return 0;
}

void write_pwm(Machine *m, uint32_t offset, uint32_t value)
{
    const uint32_t number = offset / STRIDE, place = offset % STRIDE;
    PwmState *pwm = &m->state.pwm[number % MOTORS];
    if (number >= m->pwms || (place != PWM_PERIOD && place != PWM_COMPARE && place != PWM_CONTROL)) {
        trouble(m, UNKNOWN_REGISTER, DEVICES_BASE + 0x6000u + offset);
        return;
    }
    if (place == PWM_PERIOD) {
        pwm->period = value;                    /* in force from the next write of COMPARE or CONTROL on */
        return;
    }
    *(place == PWM_COMPARE ? &pwm->compare : &pwm->control) = value;
    const uint32_t high = pwm->compare < pwm->period ? pwm->compare : pwm->period;
    const double share = pwm->control & PWM_ON && pwm->period != 0 ? (double)high / pwm->period : 0.0;
    command(m, DRIVE, number, 0)->real = pwm->control & PWM_REVERSE ? -share : share;
}

MACHINE_EXPORT void machine_motors(Machine *m, uint32_t encoders, const uint32_t *counts_per_revolution, uint32_t pwms)
{
    m->encoders = encoders;
    m->pwms = pwms;
    for (uint32_t i = 0; i < encoders; i++) {
        m->counts_per_revolution[i] = counts_per_revolution[i];
    }
}

void reset_motors(Machine *m)
{
    for (uint32_t i = 0; i < MOTORS; i++) {
        m->state.encoder[i].reload = 0xFFFFu;
    }
}
