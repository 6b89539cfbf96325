/* kernel.c: two tasks on process stacks, one unprivileged, switched by PendSV at every SysTick; each computes with the
 * FPU and with doubles, and keeps its values in FPU registers across the switches.
 * When both have done ROUNDS rounds, the frame on port 0 holds their results, and the number of switches. */
#include "machine_registers.h"

enum { ROUNDS = 20000, STACK_WORDS = 256 };

static __attribute__((aligned(8))) uint32_t stacks[2][STACK_WORDS];
uint32_t *stack_pointer[2];
uint32_t current;
static volatile uint32_t switches, finished;
static volatile float single[2];
static volatile double real[2];

__attribute__((naked)) void pendsv_handler(void)
{
    __asm__ volatile(
        "mrs r0, psp\n"
        "tst lr, #0x10\n it eq\n vstmdbeq r0!, {s16-s31}\n"
        "stmdb r0!, {r4-r11, lr}\n"
        "ldr r1, =current\n ldr r2, [r1]\n ldr r3, =stack_pointer\n str r0, [r3, r2, lsl #2]\n"
        "eor r2, r2, #1\n str r2, [r1]\n ldr r0, [r3, r2, lsl #2]\n"
        "ldmia r0!, {r4-r11, lr}\n"
        "tst lr, #0x10\n it eq\n vldmiaeq r0!, {s16-s31}\n"
        "msr psp, r0\n bx lr\n .ltorg");
}

void systick_handler(void)
{
    switches++;
    SCB_ICSR = 1u << 28;
}

/* The first call starts task 0, the later ones make the kernel's work privileged: send the results. */
void svc_handler(void)
{
    union { double real; uint32_t word[2]; } bits;
    for (uint32_t task = 0; task < 2; task++) {
        const union { float real; uint32_t word; } one = { single[task] };
        bits.real = real[task];
        PORT_TX_DATA(0) = one.word;
        PORT_TX_DATA(0) = bits.word[0];
        PORT_TX_DATA(0) = bits.word[1];
    }
    PORT_TX_DATA(0) = switches;
    PORT_TX_SEND(0) = 28;
    SYSTICK_CONTROL = 0;
    SCB_SCR = 2;                                    /* sleep when this handler returns */
}

static void task(uint32_t number)
{
    register float a = 1.0f + (float)number, b = 0.5f;
    double c = 1.0 + number;
    for (uint32_t i = 1; i <= ROUNDS; i++) {
        a = a * 1.0001f + b / (float)i;
        b = b * 0.9999f + 0.25f;
        if (i % 16 == 0) {
            c = c * 1.0001 + 1.0 / (double)i;
        }
    }
    single[number] = a + b;
    real[number] = c;
    finished |= 1u << number;                       /* one of both sees 3, since a switch saves all of this */
    while (finished != 3u) {
        finished |= 1u << number;
    }
    __asm__ volatile("svc #0");
    for (;;) {
    }
}

static void task0(void) { task(0); }

static void task1(void)
{
    __asm__ volatile("mrs r0, control\n orr r0, #1\n msr control, r0\n isb" : : : "r0");     /* unprivileged */
    task(1);
}

int main(void)
{
    uint32_t *sp = &stacks[1][STACK_WORDS] - 8 - 9;
    for (uint32_t i = 0; i < 17; i++) {
        sp[i] = 0;
    }
    sp[8] = 0xFFFFFFFDu;                            /* EXC_RETURN of a thread on its process stack */
    sp[9 + 6] = (uint32_t)task1;
    sp[9 + 7] = 1u << 24;
    stack_pointer[1] = sp;
    SCB_PRIORITY(14) = 0xFF;
    SCB_PRIORITY(15) = 0x80;
    SYSTICK_RELOAD = 999;
    SYSTICK_CONTROL = 7;
    __asm__ volatile("msr psp, %0\n mov r0, #2\n msr control, r0\n isb\n bx %1"
                     : : "r"(&stacks[0][STACK_WORDS]), "r"(task0) : "r0", "memory");
    return 0;
}
