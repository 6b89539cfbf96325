/* semantics.c: exceptions of ARMv7-M, whose results this program notes in `notes`; the same on the machine and in QEMU.
 *
 * It uses the core alone, no device. At its end it stops in `finished`, with `noted` words noted. */
#include <stdint.h>
#include "machine_registers.h"

#define NOTES 512
volatile uint32_t notes[NOTES];
volatile uint32_t noted;
volatile uint32_t done;
static volatile uint32_t pendsv_mode, irq_mode;

static void note(uint32_t word)
{
    if (noted < NOTES) {
        notes[noted++] = word;
    }
}

static void section(uint32_t number) { note(0x5EC70000u | number); }

#define READ(name) ({ uint32_t value_; __asm__ volatile("mrs %0, " #name : "=r"(value_)); value_; })
#define WRITE(name, value) __asm__ volatile("msr " #name ", %0\n isb" : : "r"(value) : "memory")
#define SVC(n) __asm__ volatile("mov r0, #" #n "\n svc #" #n : : : "r0", "memory")     /* the handler returns a value in r0 */
#define BARRIER() __asm__ volatile("dsb\n isb" : : : "memory")

static uint32_t sp_now(void)
{
    uint32_t value;
    __asm__ volatile("mov %0, sp" : "=r"(value));
    return value;
}

static void pend(uint32_t irq) { NVIC_PEND = 1u << irq; BARRIER(); }

/* Every handler notes its number, EXC_RETURN, IPSR and the stacked words that tell something. */
void handle(uint32_t *frame, uint32_t exc_return);
void handle(uint32_t *frame, uint32_t exc_return)
{
    const uint32_t exception = READ(ipsr);
    note(0xE0000000u | exception);
    note(exc_return);
    note(READ(control));
    note(frame[7] & 0x010001FFu);                   /* xPSR: Thumb, exception number; the flags are the compiler's */
    note(frame[7] >> 9 & 1u);                       /* whether the frame was aligned */
    note((uint32_t)frame & 7u);
    note(SCB_ICSR & 0x1FFu);
    note(SCB_ICSR >> 11 & 1u);                      /* RETTOBASE */
    note(exception == 11 ? frame[0] : 0);
    note(READ(primask) | READ(basepri) << 8 | READ(faultmask) << 16);
    if (exception == 11) {
        const uint8_t number = ((const uint8_t *)frame[6])[-2];
        note(number);
        frame[0] = 0x1000u + number;
        switch (number) {
        case 1: SCB_ICSR = 1u << 28; BARRIER(); note(0xAA01); break;            /* PendSV, of lower priority */
        case 2: pend(3); note(0xAA02); break;                                   /* preempts if urgent */
        case 3: WRITE(control, 0); break;                                       /* privileged again */
        case 4: frame[6] += 2; break;                                           /* skip an instruction */
        case 5: SVC(6); note(0xAA05); break;                                    /* escalates */
        default: break;
        }
    }
    if (exception == 14 && pendsv_mode == 1) {
        pendsv_mode = 0;
        pend(4);
        note(0xAA14);
    }
    if (exception == 16 + 3 && irq_mode == 1) {
        irq_mode = 0;
        pend(4);                                    /* same group: after this one, tail-chained */
        pend(5);                                    /* more urgent: nested */
        note(0xAA03);
    }
    if (exception == 3) {
        note(SCB_HFSR);
        note(SCB_CFSR);
        note(frame[6] & 1u);
        const uint16_t code = *(const uint16_t *)frame[6];
        note(code);
        if (SCB_CFSR != 0) {                        /* not an escalated SVC, whose frame returns behind it */
            frame[6] += (code >> 11) >= 0x1Du ? 4 : 2;       /* past the instruction that faulted */
        }
        SCB_HFSR = 0xFFFFFFFFu;
        SCB_CFSR = 0xFFFFFFFFu;
    }
    if (exception == 5 || exception == 6) {
        note(SCB_CFSR);
        note(exception == 5 ? SCB_BFAR : 0);
        note(SCB_SHCSR & 0x7FFFFu);
        const uint16_t code = *(const uint16_t *)frame[6];
        frame[6] += (code >> 11) >= 0x1Du ? 4 : 2;
        SCB_CFSR = 0xFFFFFFFFu;
    }
    if (exception == 2) {
        note(0xAA99);
    }
    note(0xF0000000u | exception);
}

#define ENTRY(name) __attribute__((naked)) void name(void) \
{ \
    __asm__ volatile("tst lr, #4\n ite eq\n mrseq r0, msp\n mrsne r0, psp\n mov r1, lr\n push {r4, lr}\n bl handle\n" \
                     "pop {r4, pc}"); \
}
ENTRY(svc_handler)
ENTRY(pendsv_handler)
ENTRY(nmi_handler)
ENTRY(hard_fault_handler)
ENTRY(bus_fault_handler)
ENTRY(usage_fault_handler)
ENTRY(interrupt3_handler)
ENTRY(interrupt4_handler)
ENTRY(interrupt5_handler)

static __attribute__((aligned(8))) uint32_t process_stack[256];

static __attribute__((noinline)) uint32_t svc_with(uint32_t argument, uint32_t misalign)
{
    uint32_t result;
    if (misalign) {
        __asm__ volatile("mov r0, %1\n sub sp, #4\n svc #7\n add sp, #4\n mov %0, r0"
                         : "=r"(result) : "r"(argument) : "r0", "memory");
    } else {
        __asm__ volatile("mov r0, %1\n svc #7\n mov %0, r0" : "=r"(result) : "r"(argument) : "r0", "memory");
    }
    return result;
}

static __attribute__((noinline)) void fpu_section(void)
{
    union { float real; uint32_t word; } value[4];
    const uint32_t before = sp_now();
    __asm__ volatile("vmov.f32 s0, #1.5\n vmov.f32 s15, #2.5\n vmov.f32 s16, #3.5\n vmov.f32 s31, #4.5\n"
                     "svc #8\n"
                     "vmov %0, s0\n vmov %1, s15\n vmov %2, s16\n vmov %3, s31\n"
                     : "=r"(value[0].word), "=r"(value[1].word), "=r"(value[2].word), "=r"(value[3].word)
                     : : "r0", "r1", "r2", "r3", "r12", "lr", "s0", "s15", "s16", "s31", "memory");
    for (int i = 0; i < 4; i++) {
        note(value[i].word);
    }
    note(READ(control) & 7u);                      /* bit 3 is another extension's, which Unicorn sets */
    note(before == sp_now());
}

static __attribute__((noinline)) void if_then_section(void)
{
    uint32_t a, b;
    __asm__ volatile("movs r0, #0\n cmp r0, #0\n ittee eq\n moveq %0, #1\n moveq %1, #2\n movne %0, #3\n movne %1, #4\n"
                     : "=&r"(a), "=&r"(b) : : "r0", "cc");
    note(a);
    note(b);
    __asm__ volatile("movs r0, #7\n cmp r0, #7\n itt eq\n svceq #9\n addeq r0, r0, #5\n mov %0, r0\n"
                     : "=r"(a) : : "r0", "cc", "memory");
    note(a);
}

static __attribute__((noinline)) void flags_section(void)
{
    uint32_t flags;
    __asm__ volatile("mov r0, #0x80000000\n adds r0, r0, r0\n svc #10\n mrs %0, apsr" : "=r"(flags) : : "r0", "cc", "memory");
    note(flags);
}

static void set_up(void)
{
    NVIC_ENABLE = 1u << 3 | 1u << 4 | 1u << 5;
    NVIC_PRIORITY(3) = 0x60;
    NVIC_PRIORITY(4) = 0x60;
    NVIC_PRIORITY(5) = 0x20;
}

__attribute__((noinline)) void finished(void) { done = 1; for (;;) { wait_for_interrupt(); } }

int main(void)
{
    uint32_t count = 1;
    SCB_CPACR = 0xFu << 20;
    BARRIER();
    set_up();
    *(volatile uint8_t *)0xE000ED1Fu = 0x80;        /* SVC */
    *(volatile uint8_t *)0xE000ED22u = 0xC0;        /* PendSV */
    section(count++);                               /* 1: SVC, aligned and not */
    note(svc_with(0x11, 0));
    note(svc_with(0x22, 1));
    section(count++);                               /* 2: PendSV from SVC is tail-chained */
    SVC(1);
    section(count++);                               /* 3: an interrupt preempts SVC */
    SVC(2);
    section(count++);                               /* 4: nested and tail-chained interrupts */
    irq_mode = 1;
    pend(3);
    section(count++);                               /* 5: PRIMASK delays */
    interrupts_off();
    pend(3);
    note(0xBB05);
    note(SCB_ICSR >> 12 & 0x1FFu);
    interrupts_on();
    BARRIER();
    note(0xBB06);
    section(count++);                               /* 6: BASEPRI delays equal and lower priorities */
    WRITE(basepri, 0x60);
    pend(4);
    note(0xBB07);
    pend(5);
    note(0xBB08);
    WRITE(basepri, 0);
    BARRIER();
    note(0xBB09);
    section(count++);                               /* 7: FAULTMASK delays all but NMI */
    __asm__ volatile("cpsid f" ::: "memory");
    pend(5);
    note(0xBB0A);
    SCB_ICSR = 1u << 31;
    BARRIER();
    note(0xBB0B);
    __asm__ volatile("cpsie f" ::: "memory");
    BARRIER();
    note(0xBB0C);
    section(count++);                               /* 8: FPU frames */
    fpu_section();
    section(count++);                               /* 9: IT blocks */
    if_then_section();
    section(count++);                               /* 10: flags survive */
    flags_section();
    section(count++);                               /* 11: thread on the process stack */
    WRITE(psp, (uint32_t)(process_stack + 256));
    __asm__ volatile("mrs r0, control\n orr r0, r0, #2\n msr control, r0\n isb\n svc #11\n" : : : "r0", "memory");
    {
        const uint32_t sp = READ(psp);
        note(sp - (uint32_t)process_stack);
    }
    section(count++);                               /* 12: unprivileged, back by SVC */
    __asm__ volatile("mrs r0, control\n orr r0, r0, #1\n msr control, r0\n isb\n" : : : "r0", "memory");
    note(READ(control));
    __asm__ volatile("mov r0, #0\n msr control, r0\n isb\n" : : : "r0", "memory");       /* no effect */
    note(READ(control));
    SVC(12);
    note(READ(control));
    __asm__ volatile("svc #3" : : : "r0", "memory");
    note(READ(control) & 1u);
    __asm__ volatile("mov r0, #0\n msr control, r0\n isb\n" : : : "r0", "memory");
    section(count++);                               /* 13: undefined instruction, as a hard fault and as its own */
    __asm__ volatile(".inst.n 0xde00" : : : "memory");
    SCB_SHCSR = 7u << 16;
    __asm__ volatile(".inst.n 0xde00" : : : "memory");
    section(count++);                               /* 14: escalation: SVC where its priority allows none */
    interrupts_off();
    WRITE(basepri, 0x80);
    interrupts_on();
    SVC(13);
    WRITE(basepri, 0);
    section(count++);                               /* 15: SVC within SVC */
    SVC(5);
    section(count++);                               /* 16: a bus fault within a fault's priority */
    note(SCB_SHCSR);
    section(count++);                               /* 17: PendSV, then an urgent interrupt within it */
    pendsv_mode = 1;
    SCB_ICSR = 1u << 28;
    BARRIER();
    section(count++);                               /* 18: priority groups: equal groups do not preempt */
    SCB_AIRCR = 0x05FA0000u | 6u << 8;
    note(SCB_AIRCR & 0x700u);
    irq_mode = 1;
    NVIC_PRIORITY(5) = 0x40;
    pend(3);
    SCB_AIRCR = 0x05FA0000u;
    section(count++);                               /* 19: `wfi` with PRIMASK wakes without the handler */
    interrupts_off();
    pend(4);
    wait_for_interrupt();
    note(0xBB13);
    interrupts_on();
    BARRIER();
    section(count++);                               /* 20: clear pending */
    interrupts_off();
    pend(4);
    NVIC_UNPEND = 1u << 4;
    note(NVIC_PEND);
    SCB_ICSR = 1u << 28;
    note(SCB_ICSR >> 28 & 1u);
    SCB_ICSR = 1u << 27;
    note(SCB_ICSR >> 28 & 1u);
    interrupts_on();
    BARRIER();
    section(count++);                               /* 21: registers of priorities */
    note(REGISTER(0xE000E400u));
    note(REGISTER(0xE000E404u));
    note(REGISTER(0xE000ED18u));
    note(REGISTER(0xE000ED1Cu));
    note(REGISTER(0xE000ED20u));
    note(NVIC_ENABLE);
    section(count++);                               /* 22: set enable clears */
    NVIC_DISABLE = 1u << 4;
    note(NVIC_ENABLE);
    pend(4);
    note(NVIC_PEND);
    NVIC_ENABLE = 1u << 4;
    BARRIER();
    note(0xBB16);
    finished();
    return 0;
}
