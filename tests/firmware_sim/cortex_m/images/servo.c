/* servo.c: turns a wheel with PWM and counts its encoder, every millisecond.
 *
 *     signals: 0 the count of this encoder, 1 all counts since the start, 2 whether the wheel turned backwards
 *
 * For 100 ms the stage is high for 3/4 of its period, then reversed for 1/2, then compare is beyond the period, then off. */
#include "machine_registers.h"

enum { PERIOD_NS = 1000000, PERIOD_CYCLES = 5000 };

static uint32_t ticks, before;
static int32_t total;

static void record(uint32_t signal, double value)
{
    const union { double real; uint32_t words[2]; } bits = { value };
    RECORD_LOW = bits.words[0];
    RECORD_HIGH = bits.words[1];
    RECORD_SIGNAL = signal;
}

static void arm(void)
{
    TIMER_CHANNEL = 0;
    TIMER_LOW = ticks * PERIOD_NS;
    TIMER_HIGH = 0;
    TIMER_ARM = 1;
}

void interrupt0_handler(void)
{
    TIMER_STATUS = 1;
    ENCODER_CAPTURE(1) = 1;
    const uint32_t count = ENCODER_COUNT(1), range = ENCODER_RELOAD(1) + 1u;
    int32_t moved = (int32_t)((count - before + range) % range);        /* the counter wraps around */
    if (moved > (int32_t)(range / 2u)) {
        moved -= (int32_t)range;
    }
    before = count;
    total += moved;
    record(0, count);
    record(1, total);
    record(2, ENCODER_DOWN(1));
    if (ticks == 0) {
        PWM_PERIOD(0) = PERIOD_CYCLES;
        PWM_COMPARE(0) = PERIOD_CYCLES * 3 / 4;
        PWM_CONTROL(0) = 1;
    } else if (ticks == 100) {
        PWM_COMPARE(0) = PERIOD_CYCLES / 2;
        PWM_CONTROL(0) = 3;
    } else if (ticks == 200) {
        PWM_CONTROL(0) = 1;
        PWM_COMPARE(0) = 2 * PERIOD_CYCLES;
    } else if (ticks == 300) {
        PWM_CONTROL(0) = 0;
    }
    ticks++;
    arm();
}

int main(void)
{
    ENCODER_RELOAD(1) = 999;
    ENCODER_CAPTURE(1) = 1;
    ENCODER_COUNT(1) = 0;
    before = 0;
    if (ENCODER_REVOLUTION(1) != 512u || PWM_CONTROL(0) != 0u) {
        RUN_END = 1;
    }
    arm();
    NVIC_ENABLE = 1;
    interrupts_on();
    for (;;) {
        wait_for_interrupt();
    }
}
