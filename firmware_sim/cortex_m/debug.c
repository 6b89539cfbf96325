/* debug.c: what a debugger does with a machine that does not run: breakpoints, registers, memory, checkpoints.
 *
 * A breakpoint is a hook of Unicorn at one address, so that a machine without breakpoints pays nothing. It stops the
 * machine before the instruction; within an IT block behind the block. A device's register is read without its effects:
 * the state is put back afterwards. A checkpoint holds all that decides what the machine does next, FIFOs included.
 */
#include "machine.h"
#include <stdlib.h>
#include <string.h>

enum { BREAKPOINTS = 256, CORE = 17, DOUBLES = 16, SPECIAL = 6 };

struct Debugger {
    uint32_t count, address[BREAKPOINTS];
    uc_hook hook[BREAKPOINTS];
    bool acting;
};

typedef struct {                                /* as in gdb/target.py */
    uint32_t core[CORE];                        /* r0-r12, sp, lr, pc, xpsr */
    uint64_t d[DOUBLES];
    uint32_t fpscr, special[SPECIAL];           /* msp, psp, primask, basepri, faultmask, control */
} Registers;

struct Checkpoint {
    uc_context *context;
    State state;
    uint64_t cost_num, cost_den;
    uint8_t ram[RAM_BYTES], rx[PORTS][RX_BYTES], tx[PORTS][FRAME_BYTES], detail[DETAIL_BYTES];
};

static const int SPECIAL_REGISTERS[SPECIAL] = { UC_ARM_REG_MSP, UC_ARM_REG_PSP, UC_ARM_REG_PRIMASK, UC_ARM_REG_BASEPRI,
                                                UC_ARM_REG_FAULTMASK, UC_ARM_REG_CONTROL };

static int core_register(int number)
{
    return number < 13 ? UC_ARM_REG_R0 + number : number == 13 ? UC_ARM_REG_SP : number == 14 ? UC_ARM_REG_LR
        : number == 15 ? UC_ARM_REG_PC : UC_ARM_REG_XPSR;
}

/* --- breakpoints */

static void on_breakpoint(uc_engine *uc, uint64_t address, uint32_t size, void *user)
{
    Machine *m = user;
    (void)address;
    (void)size;
    if (m->debugger->acting && !m->stopping) {
        m->halted = m->stopping = true;
        uc_emu_stop(uc);
    }
}

MACHINE_EXPORT bool machine_set_breakpoint(Machine *m, uint32_t address)
{
    if (m->debugger == NULL && (m->debugger = calloc(1, sizeof *m->debugger)) == NULL) {
        return false;
    }
    struct Debugger *d = m->debugger;
    if (d->count == BREAKPOINTS
        || uc_hook_add(m->uc, &d->hook[d->count], UC_HOOK_CODE, (void *)on_breakpoint, m, address, address)
            != UC_ERR_OK) {
        return false;
    }
    d->address[d->count++] = address;
    uc_ctl_flush_tb(m->uc);                     /* code that was translated before does not call the hook */
    return true;
}

MACHINE_EXPORT void machine_clear_breakpoint(Machine *m, uint32_t address)
{
    struct Debugger *d = m->debugger;
    for (uint32_t i = 0; d != NULL && i < d->count; i++) {
        if (d->address[i] == address) {
            uc_hook_del(m->uc, d->hook[i]);
            d->count--;
            d->address[i] = d->address[d->count];
            d->hook[i] = d->hook[d->count];
            uc_ctl_flush_tb(m->uc);
            return;
        }
    }
}

/* Let breakpoints stop the machine, or pass them over. */
MACHINE_EXPORT void machine_heed_breakpoints(Machine *m, bool heed)
{
    if (m->debugger != NULL) {
        m->debugger->acting = heed;
    }
}

/* --- registers */

MACHINE_EXPORT uint32_t machine_pc(Machine *m) { return reg(m, UC_ARM_REG_PC) & ~1u; }

MACHINE_EXPORT void machine_read_registers(Machine *m, Registers *to)
{
    for (int i = 0; i < CORE; i++) {
        to->core[i] = reg(m, core_register(i));
    }
    to->core[15] &= ~1u;
    for (int i = 0; i < DOUBLES; i++) {
        uc_reg_read(m->uc, UC_ARM_REG_D0 + i, &to->d[i]);
    }
    to->fpscr = reg(m, UC_ARM_REG_FPSCR);
    uc_context *context = NULL;
    if (!privileged(m) && uc_context_alloc(m->uc, &context) == UC_ERR_OK) {     /* Unicorn hides them from such code */
        uc_context_save(m->uc, context);
        set_reg(m, UC_ARM_REG_XPSR_NZCVQG, (to->core[16] & ~0x1FFu) | SV_CALL);
    }
    for (int i = 0; i < SPECIAL; i++) {
        to->special[i] = reg(m, SPECIAL_REGISTERS[i]);
    }
    if (context != NULL) {
        uc_context_restore(m->uc, context);
        uc_context_free(context);
        to->special[5] = reg(m, UC_ARM_REG_CONTROL);
    }
}

/* Set register `number` in the order of Registers; false for one that may not be set now. */
MACHINE_EXPORT bool machine_write_register(Machine *m, uint32_t number, uint64_t value)
{
    const uint32_t word = (uint32_t)value;
    if (number == 16) {                         /* flags only: the exception that runs is the processor's */
        const uint32_t now = reg(m, UC_ARM_REG_XPSR);
        set_reg(m, UC_ARM_REG_XPSR_NZCVQG, (word & 0xF8000000u) | (now & 0x07FFFFFFu));
    } else if (number < CORE) {
        set_reg(m, core_register((int)number), number == 15 ? word | 1u : number == 13 ? word & ~3u : word);
    } else if (number < CORE + DOUBLES) {
        uc_reg_write(m->uc, UC_ARM_REG_D0 + (int)(number - CORE), &value);
    } else if (number == CORE + DOUBLES) {
        set_reg(m, UC_ARM_REG_FPSCR, word);
    } else if (number < CORE + DOUBLES + 1 + 5 && privileged(m)) {          /* not CONTROL */
        set_reg(m, SPECIAL_REGISTERS[number - (CORE + DOUBLES + 1)], word);
        need_attention(m);
    } else {
        return false;
    }
    return true;
}

/* --- memory */

static bool peek_device(Machine *m, uint32_t address, uint32_t *word)
{
    const State kept = m->state;
    const bool attention = m->attention;
    const uint64_t stop_at = m->stop_at;
    m->state.trouble = NO_FAULT;
    if (address - DEVICES_BASE < DEVICES_BYTES) {
        *word = (uint32_t)read_device(m->uc, address - DEVICES_BASE, 4, m);
    } else if (address - SYSTEM_BASE < SYSTEM_BYTES) {
        *word = (uint32_t)read_system(m->uc, address - SYSTEM_BASE, 4, m);
    } else {
        return false;
    }
    const bool there = m->state.trouble == NO_FAULT;
    m->state = kept;
    m->attention = attention;
    m->stop_at = stop_at;
    return there;
}

/* Read up to `length` bytes; return how many there are without a gap. */
MACHINE_EXPORT uint32_t machine_read_memory(Machine *m, uint32_t address, uint32_t length, uint8_t *to)
{
    for (uint32_t i = 0; i < length; i++) {
        const uint32_t at = address + i;
        const uint8_t *byte = ram_at(m, at, 1);
        uint32_t word = 0;
        if (byte == NULL && at - FLASH_BASE < FLASH_BYTES) {
            byte = m->flash + (at - FLASH_BASE);
        }
        if (byte != NULL) {
            to[i] = *byte;
        } else if (peek_device(m, at & ~3u, &word)) {
            to[i] = (uint8_t)(word >> 8 * (at & 3u));
        } else {
            return i;
        }
    }
    return length;
}

/* Write into the RAM; false outside of it. */
MACHINE_EXPORT bool machine_write_memory(Machine *m, uint32_t address, uint32_t length, const uint8_t *from)
{
    uint8_t *place = ram_at(m, address, length);
    if (place != NULL && length > 0) {
        grow(m->engine, address + length - 1);
        memcpy(place, from, length);
    }
    return place != NULL;
}

/* --- checkpoints */

MACHINE_EXPORT void machine_free_checkpoint(struct Checkpoint *c)
{
    if (c != NULL && c->context != NULL) {
        uc_context_free(c->context);
    }
    free(c);
}

MACHINE_EXPORT struct Checkpoint *machine_new_checkpoint(Machine *m)
{
    struct Checkpoint *c = calloc(1, sizeof *c);
    if (c == NULL || uc_context_alloc(m->uc, &c->context) != UC_ERR_OK) {
        free(c);
        return NULL;
    }
    uc_context_save(m->uc, c->context);
    c->state = m->state;
    c->cost_num = m->cost_num;
    c->cost_den = m->cost_den;
    memcpy(c->ram, m->ram, sizeof c->ram);
    memcpy(c->rx, m->rx_bytes, sizeof c->rx);
    memcpy(c->tx, m->tx_bytes, sizeof c->tx);
    memcpy(c->detail, m->detail, sizeof c->detail);
    return c;
}

MACHINE_EXPORT void machine_return_to(Machine *m, const struct Checkpoint *c)
{
    uc_context_restore(m->uc, c->context);
    m->state = c->state;
    m->cost_num = c->cost_num;
    m->cost_den = c->cost_den;
    memcpy(m->ram, c->ram, sizeof c->ram);
    memcpy(m->rx_bytes, c->rx, sizeof c->rx);
    memcpy(m->tx_bytes, c->tx, sizeof c->tx);
    memcpy(m->detail, c->detail, sizeof c->detail);
    clear_commands(m);
    m->attention = m->halted = false;
    fill_report(m);
}
