/* devices.c: uses each device once. Ports: 0 radio, 1 can, 2 serial. Each result is a word of a frame on the radio. */
#include "machine_registers.h"

static void put(uint32_t word) { PORT_TX_DATA(0) = word; }
static volatile uint32_t ticks;

void systick_handler(void)
{
    if (++ticks == 3) {
        SYSTICK_CONTROL = 0;
    }
    put(ticks);
    put(CLOCK_LOW);
    PORT_TX_SEND(0) = 8;
}

void interrupt9_handler(void)                       /* CAN: an echo with another identifier */
{
    put(PORT_CAN_RX(1, 0));
    put(PORT_CAN_RX(1, 1) & 0xFFu);
    put(PORT_CAN_RX(1, 2));
    PORT_TX_SEND(0) = 12;
    for (uint32_t i = 0; i < 4; i++) {
        PORT_CAN_TX(1, i) = PORT_CAN_RX(1, i);
    }
    PORT_CAN_TX(1, 0) = 0x321;
    PORT_CAN_REQUEST(1) = 1;
    PORT_RX_NEXT(1) = 1;
}

void interrupt10_handler(void)                      /* UART: each byte plus one */
{
    while (PORT_UART_STATUS(2) & 1u) {
        PORT_UART_DATA(2) = PORT_UART_DATA(2) + 1u;
    }
}

int main(void)
{
    put(BOARD_RESET_CAUSE);
    put(BOARD_IDENTITY);
    put(BOARD_UNIQUE_ID(0));
    put(PORT_KIND(0) << 16 | PORT_KIND(1) << 8 | PORT_KIND(2));
    RANDOM_DRAW = 1;
    put(RANDOM_DATA);
    RANDOM_DRAW = 1;
    put(RANDOM_DATA);
    CLOCK_STEP_LOW = 500;
    CLOCK_ADJUST = 1;
    put(CLOCK_LOW);
    PORT_TX_SEND(0) = 28;
    PORT_TX_SEND(0) = 1;                            /* more than is in the FIFO: nothing is sent */
    RECORD_LOW = 6u + PORT_TX_OVERFLOW(0);
    PORT_TX_OVERFLOW(0) = 0;
    RECORD_COUNTER = 0;
    for (const char *c = "hello"; *c; c++) {
        RECORD_TEXT = (uint8_t)*c;
    }
    RECORD_EVENT = 0;
    PORT_CAN_FILTER_ID(1, 0) = 0x120;
    PORT_CAN_FILTER_MASK(1, 0) = 0x7F0;
    PORT_CAN_FILTERS(1) = 1;
    PORT_CONTROL(1) = 1;
    PORT_CONTROL(2) = 1;
    NVIC_ENABLE = 1u << PERIPHERAL_PORT(1) | 1u << PERIPHERAL_PORT(2);
    SYSTICK_RELOAD = 99999;                         /* 1 ms of 100 MHz */
    SYSTICK_CONTROL = 7;
    if (BOARD_RESET_CAUSE == 0) {
        WATCHDOG_FEED = 20000;
    } else if (BOARD_RESET_CAUSE == 1) {
        SYSTICK_CONTROL = 0;
        SCB_AIRCR = 0x05FA0004u;
    }
    for (;;) {
        wait_for_interrupt();
    }
}
