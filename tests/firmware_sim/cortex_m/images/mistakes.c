/* mistakes.c: one mistake each, chosen by the value of parameter 0; with 0 it sleeps */
#include "machine_registers.h"

uint32_t keep;

__attribute__((noinline)) uint32_t overflow(uint32_t depth)
{
    volatile uint32_t deep[10] = { depth };
    return depth == 0 ? 0 : overflow(depth + 1) + deep[0];
}

__attribute__((noinline)) void blunder(uint32_t mistake)
{
    switch (mistake) {
    case 1:
        keep = *(volatile uint32_t *)0x30000000u;
        break;
    case 2:
        *(volatile uint32_t *)0x50000000u = keep + 5u;
        keep = 2;
        break;
    case 3:
        *(volatile uint32_t *)0x00000100u = 1;
        keep = 3;
        break;
    case 4:
        __asm__ volatile(".inst.n 0xde01");
        break;
    case 5:
        keep = overflow(mistake);
        break;
    case 6:
        for (;;) {
            keep++;
            __asm__ volatile("" ::: "memory");
        }
        break;
    case 7:
        TIMER_CHANNEL = 1;
        REGISTER(0x40001044u) = 5;
        keep = 1;
        break;
    case 8:
        ((void (*)(void))0x20000001u)();
        keep = 1;
        break;
    case 9:
        RUN_END = 77;
        keep = 1;
        break;
    case 10:
        PLANT_ACTUATOR = 3;
        keep = 1;
        break;
    case 11:
        __asm__ volatile("mov r0, #1\n msr control, r0\n isb" : : : "r0");
        NVIC_ENABLE = 1;
        break;
    case 12:
        __asm__ volatile("cpsid f\n svc #0");
        break;
    default: break;
    }
}

int main(void)
{
    VALUES_PARAMETER = 0;
    const union { uint32_t words[2]; double real; } bits = { { VALUES_LOW, VALUES_HIGH } };
    blunder((uint32_t)bits.real);
    for (;;) {
        wait_for_interrupt();
    }
}
