/* beacon.c: a frame of 8 bytes, frames sent and sum of what was heard, at offset + k * period of the local clock.
 * values: 0 period [ns], 1 offset [ns], 2 rounds of a loop before each frame, 3 priority of arriving frames: below 128
 * they preempt the timer's handler */
#include "machine_registers.h"

static uint32_t sent, heard;
static int64_t next_ns, period_ns;
static uint32_t rounds;

static int64_t value(uint32_t parameter)
{
    VALUES_PARAMETER = parameter;
    VALUES_INDEX = 0;
    const union { uint32_t words[2]; double real; } bits = { { VALUES_LOW, VALUES_HIGH } };
    return (int64_t)bits.real;
}

static void arm(void)
{
    TIMER_CHANNEL = 3;
    TIMER_LOW = (uint32_t)next_ns;
    TIMER_HIGH = (uint32_t)(next_ns >> 32);
    TIMER_ARM = 0;
}

void interrupt0_handler(void)
{
    TIMER_STATUS = 1u << 3;
    for (volatile uint32_t i = 0; i < rounds; i++) {
    }
    PORT_TX_DATA(0) = sent++;
    PORT_TX_DATA(0) = heard;
    PORT_TX_SEND(0) = 8;
    next_ns += period_ns;
    arm();
}

void interrupt8_handler(void)
{
    heard += PORT_RX_DATA(0) + 1u;
    PORT_RX_NEXT(0) = 0;
}

int main(void)
{
    period_ns = value(0);
    next_ns = value(1);
    rounds = (uint32_t)value(2);
    NVIC_PRIORITY(0) = 0x80;
    NVIC_PRIORITY(8) = (uint8_t)value(3);
    NVIC_ENABLE = 1u << PERIPHERAL_TIMER | 1u << PERIPHERAL_PORT(0);
    PORT_CONTROL(0) = 1;
    arm();
    interrupts_on();
    for (;;) {
        wait_for_interrupt();
    }
}
