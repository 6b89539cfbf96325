/* far.c: sums what it hears, in RAM that the image does not declare if value 0 is 1, and sends each sum at once. */
#include "machine_registers.h"

static uint32_t near;

static volatile uint32_t *sum(void)
{
    VALUES_PARAMETER = 0;
    VALUES_INDEX = 0;
    return VALUES_HIGH != 0 ? (volatile uint32_t *)0x2001F000u : (volatile uint32_t *)&near;
}

void interrupt8_handler(void)
{
    *sum() += PORT_RX_DATA(0);
    PORT_RX_NEXT(0) = 1;
    PORT_TX_DATA(0) = *sum();
    PORT_TX_SEND(0) = 4;
}

int main(void)
{
    PORT_CONTROL(0) = 1;
    NVIC_ENABLE = 1u << PERIPHERAL_PORT(0);
    interrupts_on();
    for (;;) {
        wait_for_interrupt();
    }
}
