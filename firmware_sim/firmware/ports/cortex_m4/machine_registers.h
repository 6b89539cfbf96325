/* machine_registers.h: the registers of the emulated Cortex-M4 (docs/cortex_m.md) */
#ifndef MACHINE_REGISTERS_H
#define MACHINE_REGISTERS_H

#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))

/* board: identity, random numbers, local clock, promise, watchdog, end */
#define BOARD_IDENTITY REGISTER(0x40000000u)        /* r: 0x344D434D */
#define BOARD_UNIQUE_ID(i) REGISTER(0x40000004u + 4u * (i))     /* r: i = 0 to 3, of the robot's name */
#define BOARD_RESET_CAUSE REGISTER(0x40000014u)     /* r: 0 power, 1 watchdog, 2 software */
#define RANDOM_DRAW REGISTER(0x40000020u)           /* w: draw 32 random bits ... */
#define RANDOM_DATA REGISTER(0x40000024u)           /* r: ... which are here */
#define CLOCK_CAPTURE REGISTER(0x40000030u)         /* w: capture the local time [ns]; an interrupt does so too */
#define CLOCK_LOW REGISTER(0x40000034u)             /* r */
#define CLOCK_HIGH REGISTER(0x40000038u)            /* r */
#define CLOCK_STEP_LOW REGISTER(0x40000040u)        /* w [ns] */
#define CLOCK_STEP_HIGH REGISTER(0x40000044u)       /* w */
#define CLOCK_TRIM_LOW REGISTER(0x40000048u)        /* w: bits of a double [ppm] */
#define CLOCK_TRIM_HIGH REGISTER(0x4000004Cu)       /* w */
#define CLOCK_ADJUST REGISTER(0x40000050u)          /* w: step the local clock and trim its rate, then capture */
#define PROMISE_LOW REGISTER(0x40000060u)           /* w [ns] of local time */
#define PROMISE_HIGH REGISTER(0x40000064u)          /* w */
#define PROMISE_GIVE REGISTER(0x40000068u)          /* w: promise silence; 1: whatever arrives */
#define WATCHDOG_FEED REGISTER(0x40000070u)         /* w [us]: reset after this time unless written again; 0: never */
#define RUN_END REGISTER(0x40000074u)               /* w: end the run as failed, with this code */

/* timer: 32 channels on the local clock, interrupt 0 */
#define TIMER_CHANNEL REGISTER(0x40001000u)         /* w: the channel for the registers below */
#define TIMER_LOW REGISTER(0x40001004u)             /* w [ns] */
#define TIMER_HIGH REGISTER(0x40001008u)            /* w */
#define TIMER_ARM REGISTER(0x4000100Cu)             /* w: ring at this local time; 1: leads to no frame */
#define TIMER_DELAY REGISTER(0x40001010u)           /* w: ring after this true time; flags as above */
#define TIMER_CANCEL REGISTER(0x40001014u)          /* w: disarm */
#define TIMER_STATUS REGISTER(0x40001018u)          /* r: bit of each channel that rang; w: clear these bits */

/* plant: sensors and actuators by number */
#define PLANT_SENSOR REGISTER(0x40002000u)          /* w: read this sensor ... */
#define PLANT_STATUS REGISTER(0x40002004u)          /* r: ... 0, or a negative BoardError */
#define PLANT_SENSE_LOW REGISTER(0x40002008u)       /* r: bits of a double */
#define PLANT_SENSE_HIGH REGISTER(0x4000200Cu)      /* r */
#define PLANT_ACTUATE_LOW REGISTER(0x40002010u)     /* w: bits of a double ... */
#define PLANT_ACTUATE_HIGH REGISTER(0x40002014u)    /* w */
#define PLANT_ACTUATOR REGISTER(0x40002018u)        /* w: ... for this actuator */

/* values: the parameters of the scenario */
#define VALUES_PARAMETER REGISTER(0x40003000u)      /* w */
#define VALUES_INDEX REGISTER(0x40003004u)          /* w */
#define VALUES_LENGTH REGISTER(0x40003008u)         /* r: number of values of the parameter, 0: no such parameter */
#define VALUES_LOW REGISTER(0x4000300Cu)            /* r: bits of a double */
#define VALUES_HIGH REGISTER(0x40003010u)           /* r */

/* records */
#define RECORD_LOW REGISTER(0x40004000u)            /* w: bits of a double, or a number to count */
#define RECORD_HIGH REGISTER(0x40004004u)           /* w */
#define RECORD_SIGNAL REGISTER(0x40004008u)         /* w: this signal has the double from now on */
#define RECORD_COUNTER REGISTER(0x4000400Cu)        /* w: add the number to this counter */
#define RECORD_TEXT REGISTER(0x40004010u)           /* w: one more byte of the text ... */
#define RECORD_EVENT REGISTER(0x40004014u)          /* w: ... of this event */
#define RECORD_MISTAKE REGISTER(0x40004018u)        /* w: end the run: the text is a function's name, the number a code */

/* motors: encoder i and PWM stage i, 0 to 7, as the scenario has them */
#define ENCODER_REGISTER(i, offset) REGISTER(0x40005000u + 0x20u * (i) + (offset))
#define ENCODER_CAPTURE(i) ENCODER_REGISTER(i, 0x00u)           /* w: capture the count ... */
#define ENCODER_COUNT(i) ENCODER_REGISTER(i, 0x04u)             /* r: ... which is here; w: let it be this number */
#define ENCODER_RELOAD(i) ENCODER_REGISTER(i, 0x08u)            /* rw: greatest count, 0xFFFF after a reset */
#define ENCODER_REVOLUTION(i) ENCODER_REGISTER(i, 0x0Cu)        /* r: counts per revolution */
#define ENCODER_DOWN(i) ENCODER_REGISTER(i, 0x10u)              /* r: 1 it turned backwards before the capture */
#define PWM_REGISTER(i, offset) REGISTER(0x40006000u + 0x20u * (i) + (offset))
#define PWM_PERIOD(i) PWM_REGISTER(i, 0x00u)        /* rw [cycles] */
#define PWM_COMPARE(i) PWM_REGISTER(i, 0x04u)       /* rw [cycles]: high for so long in each period, from now on */
#define PWM_CONTROL(i) PWM_REGISTER(i, 0x08u)       /* rw: 1 on, 2 reversed, from now on */

/* port p, in the order of the scenario: interrupt 8 + p while frames wait and it is enabled */
#define PORT_REGISTER(p, offset) REGISTER(0x40010000u + 0x1000u * (p) + (offset))
#define PORT_BYTE(p, offset) (*(volatile uint8_t *)(0x40010000u + 0x1000u * (p) + (offset)))
#define PORT_KIND(p) PORT_REGISTER(p, 0x00u)        /* r: 1 frames, 2 CAN, 3 UART */
#define PORT_CONTROL(p) PORT_REGISTER(p, 0x04u)     /* rw: 1 interrupt */
#define PORT_FRAMES(p) PORT_REGISTER(p, 0x08u)      /* r: number of frames waiting */
#define PORT_RX_LENGTH(p) PORT_REGISTER(p, 0x0Cu)   /* r: bytes of the first frame waiting */
#define PORT_RX_DATA(p) PORT_REGISTER(p, 0x10u)     /* r: its next 4 bytes */
#define PORT_RX_BYTE(p) PORT_BYTE(p, 0x10u)         /* r: its next byte */
#define PORT_RX_NEXT(p) PORT_REGISTER(p, 0x14u)     /* w: drop it */
#define PORT_TX_DATA(p) PORT_REGISTER(p, 0x18u)     /* w: 4 more bytes into the FIFO */
#define PORT_TX_BYTE(p) PORT_BYTE(p, 0x18u)         /* w: 1 more byte */
#define PORT_TX_SEND(p) PORT_REGISTER(p, 0x1Cu)     /* w: send so many bytes of it as a frame, empty it */
#define PORT_TX_ROOM(p) PORT_REGISTER(p, 0x20u)     /* r: bytes that it still takes */
#define PORT_RX_LOST(p) PORT_REGISTER(p, 0x24u)     /* r: frames that found no room; w: 0 */
#define PORT_TX_OVERFLOW(p) PORT_REGISTER(p, 0x28u) /* r: 1 more bytes were written, or to be sent, than it holds; w: 0 */
#define PORT_UART_DATA(p) PORT_REGISTER(p, 0x40u)   /* r: next byte received; w: send a byte */
#define PORT_UART_STATUS(p) PORT_REGISTER(p, 0x44u) /* r: 1 a byte waits, 2 there is room to send */
#define PORT_CAN_TX(p, i) PORT_REGISTER(p, 0x80u + 4u * (i))    /* w: identifier and flags, length, data, data */
#define PORT_CAN_REQUEST(p) PORT_REGISTER(p, 0x90u) /* w: send the frame */
#define PORT_CAN_RX(p, i) PORT_REGISTER(p, 0xA0u + 4u * (i))    /* r: the first frame waiting, likewise */
#define PORT_CAN_FILTERS(p) PORT_REGISTER(p, 0xB0u) /* w: number of filters in use, 0: every frame passes */
#define PORT_CAN_FILTER_ID(p, i) PORT_REGISTER(p, 0x100u + 8u * (i))
#define PORT_CAN_FILTER_MASK(p, i) PORT_REGISTER(p, 0x104u + 8u * (i))      /* bits in which an identifier must agree */

/* the processor's own, of ARMv7-M */
#define NVIC_ENABLE REGISTER(0xE000E100u)
#define NVIC_DISABLE REGISTER(0xE000E180u)
#define NVIC_PEND REGISTER(0xE000E200u)
#define NVIC_UNPEND REGISTER(0xE000E280u)
#define NVIC_PRIORITY(i) (*(volatile uint8_t *)(0xE000E400u + (i)))
#define SYSTICK_CONTROL REGISTER(0xE000E010u)
#define SYSTICK_RELOAD REGISTER(0xE000E014u)
#define SYSTICK_VALUE REGISTER(0xE000E018u)
#define SCB_ICSR REGISTER(0xE000ED04u)
#define SCB_VTOR REGISTER(0xE000ED08u)
#define SCB_AIRCR REGISTER(0xE000ED0Cu)
#define SCB_SCR REGISTER(0xE000ED10u)
#define SCB_PRIORITY(exception) (*(volatile uint8_t *)(0xE000ED14u + (exception)))      /* exceptions 4 to 15 */
#define SCB_SHCSR REGISTER(0xE000ED24u)
#define SCB_CFSR REGISTER(0xE000ED28u)
#define SCB_HFSR REGISTER(0xE000ED2Cu)
#define SCB_BFAR REGISTER(0xE000ED38u)
#define SCB_CPACR REGISTER(0xE000ED88u)

#define PERIPHERAL_TIMER 0u
#define PERIPHERAL_PORT(p) (8u + (p))

static inline void wait_for_interrupt(void) { __asm__ volatile("wfi" ::: "memory"); }
static inline uint32_t active_exception(void)
{
    uint32_t number;
    __asm__ volatile("mrs %0, ipsr" : "=r"(number));
    return number;
}
/* In privileged code on the main stack: its FPU registers need not outlive an interrupt. */
static inline void forget_fpu(void) { __asm__ volatile("msr control, %0\n\tisb" : : "r"(0) : "memory"); }
static inline void interrupts_on(void) { __asm__ volatile("cpsie i" ::: "memory"); }
static inline void interrupts_off(void) { __asm__ volatile("cpsid i" ::: "memory"); }

#endif
