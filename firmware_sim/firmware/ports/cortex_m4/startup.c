/* startup.c: vector table and start of an image for the emulated Cortex-M4; `main` is called with all interrupts off.
 *
 * A program replaces a handler by defining a function of its name. Handlers of faults that no program replaces stop at a
 * breakpoint, which without a debugger locks the processor up: the node ends with the first fault. */
#include <stdint.h>

extern uint32_t stack_top[], data_start[], data_end[], bss_start[], bss_end[];
extern const uint32_t data_load[];
int main(void);
void reset_handler(void);

void reset_handler(void)
{
    const uint32_t *from = data_load;
    for (uint32_t *to = data_start; to < data_end; to++) {
        *to = *from++;
    }
    for (uint32_t *to = bss_start; to < bss_end; to++) {
        *to = 0;
    }
    main();
    for (;;) {
        __asm__ volatile("wfi");
    }
}

void unexpected_handler(void);
void unexpected_handler(void) { __asm__ volatile("bkpt #0"); }

#define HANDLER(name) void name(void) __attribute__((weak, alias("unexpected_handler")))
HANDLER(nmi_handler);
HANDLER(hard_fault_handler);
HANDLER(memory_fault_handler);
HANDLER(bus_fault_handler);
HANDLER(usage_fault_handler);
HANDLER(svc_handler);
HANDLER(debug_handler);
HANDLER(pendsv_handler);
HANDLER(systick_handler);
HANDLER(interrupt_handler);     /* of every external interrupt that has no handler of its own */
#define INTERRUPT(n) void interrupt##n##_handler(void) __attribute__((weak, alias("interrupt_handler_entry")))
void interrupt_handler_entry(void);
void interrupt_handler_entry(void) { interrupt_handler(); }
INTERRUPT(0); INTERRUPT(1); INTERRUPT(2); INTERRUPT(3); INTERRUPT(4); INTERRUPT(5); INTERRUPT(6); INTERRUPT(7);
INTERRUPT(8); INTERRUPT(9); INTERRUPT(10); INTERRUPT(11); INTERRUPT(12); INTERRUPT(13); INTERRUPT(14); INTERRUPT(15);

typedef void (*Handler)(void);
extern const Handler vectors[48];
__attribute__((section(".vectors"), used)) const Handler vectors[48] = {
    (Handler)stack_top, reset_handler, nmi_handler, hard_fault_handler, memory_fault_handler, bus_fault_handler,
    usage_fault_handler, 0, 0, 0, 0, svc_handler, debug_handler, 0, pendsv_handler, systick_handler,
    interrupt0_handler, interrupt1_handler, interrupt2_handler, interrupt3_handler, interrupt4_handler,
    interrupt5_handler, interrupt6_handler, interrupt7_handler, interrupt8_handler, interrupt9_handler,
    interrupt10_handler, interrupt11_handler, interrupt12_handler, interrupt13_handler, interrupt14_handler,
    interrupt15_handler, interrupt_handler_entry, interrupt_handler_entry, interrupt_handler_entry,
    interrupt_handler_entry, interrupt_handler_entry, interrupt_handler_entry, interrupt_handler_entry,
    interrupt_handler_entry, interrupt_handler_entry, interrupt_handler_entry, interrupt_handler_entry,
    interrupt_handler_entry, interrupt_handler_entry, interrupt_handler_entry, interrupt_handler_entry,
    interrupt_handler_entry
};
