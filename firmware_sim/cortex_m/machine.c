/* machine.c: runs a program on Unicorn's Cortex-M4.
 *
 *     machine_run:  exceptions that are due --> instructions --> why they stopped --> ...   until there is nothing to do
 */
#include "machine.h"
#include <stdlib.h>
#include <string.h>

#define NOWHERE 0xF0000000u                     /* no program gets there: nothing is mapped */

struct Snapshot {
    uc_context *context;
    State state;
    uint32_t ram_bytes;                         /* the rest is 0 */
    uint8_t ram[RAM_BYTES];
};

uint32_t reg(Machine *m, int name)
{
    uint32_t value = 0;
    uc_reg_read(m->uc, name, &value);
    return value;
}

void set_reg(Machine *m, int name, uint32_t value) { uc_reg_write(m->uc, name, &value); }

uint8_t *ram_at(Machine *m, uint32_t address, uint32_t length)
{
    const uint32_t place = address - RAM_BASE;
    return place < RAM_BYTES && length <= RAM_BYTES - place ? m->ram + place : NULL;
}

bool read_word(Machine *m, uint32_t address, uint32_t *word)
{
    const uint8_t *from = ram_at(m, address, 4);
    if (from == NULL && address - FLASH_BASE <= FLASH_BYTES - 4) {
        from = m->flash + (address - FLASH_BASE);
    }
    if (from != NULL) {
        memcpy(word, from, 4);
    }
    return from != NULL;
}

bool privileged(Machine *m) { return reg(m, UC_ARM_REG_IPSR) != 0 || !(reg(m, UC_ARM_REG_CONTROL) & 1u); }

static int64_t time_of(const Machine *m, uint64_t count)
{
    if (m->cost_num == 0) {
        return m->state.base_ns;
    }
    const unsigned __int128 passed = (unsigned __int128)(count - m->state.base_count) * m->cost_num;
    return m->state.base_ns + (int64_t)(passed / m->cost_den);
}

int64_t now_ns(const Machine *m) { return time_of(m, m->state.count); }

/* Return the first count that is reached at or after `time`; UINT64_MAX if computing takes no time. */
static uint64_t count_at(const Machine *m, int64_t time)
{
    if (m->cost_num == 0 || time == INT64_MAX) {
        return UINT64_MAX;
    }
    if (time <= m->state.base_ns) {
        return m->state.base_count;
    }
    const unsigned __int128 passed = (unsigned __int128)(uint64_t)(time - m->state.base_ns) * m->cost_den;
    const unsigned __int128 counts = (passed + m->cost_num - 1) / m->cost_num;
    return counts > UINT64_MAX / 2 ? UINT64_MAX : m->state.base_count + (uint64_t)counts;
}

void need_attention(Machine *m)
{
    m->attention = true;
    m->stop_at = 0;
}

void trouble(Machine *m, Cause cause, uint32_t address)
{
    if (m->state.trouble == NO_FAULT) {
        m->state.trouble = cause;
        m->state.trouble_address = address;
        m->state.trouble_pc = m->pc;
        if (m->by_blocks) {
            stop(m);                            /* Unicorn stops with PC at this instruction, which `settle` passes */
        }
    }
    need_attention(m);
}

/* --- the loop */

static bool is_wait_for_event(Machine *m)
{
    uint16_t code;
    if (m->pc - FLASH_BASE > FLASH_BYTES - 4) {
        return false;
    }
    memcpy(&code, m->flash + (m->pc - FLASH_BASE), 2);
    if (code == 0xBF20) {
        return true;
    }
    uint16_t second;
    memcpy(&second, m->flash + (m->pc - FLASH_BASE) + 2, 2);
    return code == 0xF3AF && second == 0x8002;
}

/* Where a run by blocks stopped, find the instruction, and correct the count. */
static void stopped_in_block(Machine *m, uint32_t pc)
{
    if (m->state.trouble != NO_FAULT && m->block_bytes != 0) {
        const uint32_t next = pc + bytes_of(m, pc);
        m->state.count -= instructions_of(m, next, m->pc + m->block_bytes - next);
        m->pc = m->state.trouble_pc = pc;
        set_reg(m, UC_ARM_REG_PC, next | 1u);
    } else {
        set_reg(m, UC_ARM_REG_PC, m->pc | 1u);  /* Unicorn's is that of the block before */
    }
}

/* Let the processor act on why Unicorn returned. */
static void settle(Machine *m, uc_err error)
{
    const uint32_t interrupt = m->interrupt, invalid = m->invalid;
    const uint32_t pc = reg(m, UC_ARM_REG_PC);
    m->interrupt = 0;
    m->invalid = NO_FAULT;
    if (interrupt == 8 + 1) {
        return_from_exception(m, pc | 1u);
    } else if (interrupt == 2 + 1) {
        call_supervisor(m, pc);
    } else if (interrupt == 7 + 1) {
        raise_fault(m, HARD_FAULT, BREAKPOINT, m->pc, m->pc, 0);
    } else if (interrupt != 0) {
        raise_fault(m, USAGE_FAULT, BAD_STATE, m->pc, pc, 1u << 17);
    } else if (invalid == UNDEFINED) {
        if (is_wait_for_event(m)) {
            set_reg(m, UC_ARM_REG_PC, pc | 1u);
            m->state.asleep = !m->state.event_register;
            m->state.event_register = false;
        } else {
            raise_fault(m, USAGE_FAULT, UNDEFINED, m->pc, m->pc, 1u << 16);
        }
    } else if (invalid == BAD_FETCH) {
        raise_fault(m, BUS_FAULT, BAD_FETCH, m->invalid_address, m->invalid_address, 1u << 8);
    } else if (invalid != NO_FAULT) {
        raise_fault(m, BUS_FAULT, (Cause)invalid, m->pc, m->invalid_address, 1u << 9 | 1u << 15);
    } else if (error == UC_ERR_EXCEPTION) {
        raise_fault(m, USAGE_FAULT, BAD_STATE, m->pc, pc, 1u << 17);
    } else if (error != UC_ERR_OK) {
        raise_fault(m, HARD_FAULT, ENGINE, m->pc, (uint32_t)error, 0);
    } else if (m->stopping && m->by_blocks) {
        stopped_in_block(m, pc);
    } else if (m->stopping) {
        if (pc == m->pc) {
            m->state.count--;                   /* stopped before the instruction that was counted last */
        }
    } else {
        m->state.asleep = true;                 /* wfi */
    }
}

static uint32_t run(Machine *m, int64_t until_ns, uint64_t budget)
{
    State *s = &m->state;
    make_current(m);
    m->spent = 0;
    m->ends = m->ends && m->report.commands > 0;
    for (;;) {
        if (s->locked_up) {
            return LOCKED_UP;
        }
        if (s->trouble != NO_FAULT) {
            const Cause cause = (Cause)s->trouble;
            s->trouble = NO_FAULT;
            raise_fault(m, BUS_FAULT, cause, s->trouble_pc, s->trouble_address, 1u << 10);
            continue;
        }
        if (m->report.commands > 0 && m->attention) {
            m->attention = false;
            return HAS_COMMANDS;
        }
        m->attention = false;
        run_tick(m);
        if (s->asleep && would_wake(m)) {
            s->asleep = false;
        }
        if (!s->asleep && take_pending(m)) {
            continue;
        }
        if (s->asleep) {
            return SLEEPS;
        }
        const uint64_t reached = count_at(m, until_ns), tick = count_at(m, next_tick_ns(m));
        const uint64_t last = budget > m->spent ? budget - m->spent : 0;
        if (s->count >= reached || s->count >= last) {
            return REACHED_LIMIT;
        }
        m->limit = reached < last ? reached : last;
        if (tick < m->limit) {
            m->limit = tick;
        }
        m->stop_at = m->watching ? 0 : m->limit;
        m->stopping = false;
        const uc_err error = uc_emu_start(m->uc, reg(m, UC_ARM_REG_PC) | 1u, NOWHERE, 0, 0);
        settle(m, error);
        if (m->halted) {
            m->halted = false;
            return HALTED;
        }
    }
}

void fill_report(Machine *m)
{
    m->report.count = m->state.count;
    m->report.next_tick_ns = next_tick_ns(m);
    m->report.wakers = m->state.enabled[EXTERNAL + IRQ_TIMER] ? 1u : 0u;
    for (uint32_t port = 0; port < m->ports; port++) {
        m->report.wakers |= m->state.enabled[EXTERNAL + IRQ_PORT + port] && m->state.port[port].control & 1u ? 2u : 0u;
    }
}

/* --- for machine.py */

/* Run until the program sleeps, asks for something, or reaches `until_ns` or the count `budget`; return a Stop.
 * The entry of an exception takes some of the budget, as it takes the emulator long. */
MACHINE_EXPORT uint32_t machine_run(Machine *m, int64_t until_ns, uint64_t budget)
{
    const uint32_t stopped = run(m, until_ns, budget);
    fill_report(m);
    return stopped;
}

/* From now on count instructions by blocks of code, and let `ask` answer requests; share
 * an engine with boards that run the same image. For a machine that has not run and for which computing takes no time:
 * it stops at ends of blocks. */
MACHINE_EXPORT bool machine_run_by_blocks(Machine *m, Ask ask)
{
    m->ask = ask;
    m->by_blocks = true;
    return share_engine(m);
}

/* The image declares so much of the RAM, from its beginning on. */
MACHINE_EXPORT bool machine_declare_ram(Machine *m, uint32_t bytes) { return declare_ram(m->engine, bytes); }

MACHINE_EXPORT void machine_free(Machine *m)
{
    if (m->snapshot != NULL) {
        if (m->snapshot->context != NULL) {
            uc_context_free(m->snapshot->context);
        }
        free(m->snapshot);
    }
    free(m->debugger);
    leave_engine(m);
    free(m->rx_bytes);
    free(m->tx_bytes);
    free(m->journal.bytes);
    free(m);
}

MACHINE_EXPORT Machine *machine_new(uint64_t tick_num, uint64_t tick_den, uint64_t cost_num, uint64_t cost_den)
{
    Machine *m = calloc(1, sizeof *m);
    if (m == NULL) {
        return NULL;
    }
    m->rx_bytes = calloc(PORTS, RX_BYTES);
    m->tx_bytes = calloc(PORTS, FRAME_BYTES);
    m->journal.bytes = calloc(1, COMMAND_BYTES);
    m->tick_num = tick_num;
    m->tick_den = tick_den;
    m->cost_num = cost_num;
    m->cost_den = cost_den;
    m->each_command_stops = cost_num != 0;
    if (!m->rx_bytes || !m->tx_bytes || !m->journal.bytes || !new_engine(m)) {
        machine_free(m);
        return NULL;
    }
    return m;
}

/* Place `length` bytes of the image into the flash; false if they do not fit. */
MACHINE_EXPORT bool machine_load(Machine *m, uint32_t address, const uint8_t *data, uint32_t length)
{
    const uint32_t place = address - FLASH_BASE;
    if (place > FLASH_BYTES || length > FLASH_BYTES - place) {
        return false;
    }
    memcpy(m->flash + place, data, length);
    return true;
}

MACHINE_EXPORT void machine_identify(Machine *m, const uint32_t *id) { memcpy(m->id, id, sizeof m->id); }

MACHINE_EXPORT void machine_ports(Machine *m, uint32_t ports, const uint32_t *kinds)
{
    m->ports = ports;
    memcpy(m->port_kind, kinds, ports * sizeof *kinds);
}

/* The main stack is between these addresses. */
MACHINE_EXPORT void machine_stack(Machine *m, uint32_t low, uint32_t top)
{
    m->stack_low = low;
    m->stack_top = top;
}

MACHINE_EXPORT void machine_parameters(Machine *m, uint32_t parameters, const double *values, const uint32_t *first)
{
    m->parameters = parameters;
    m->values = values;
    m->first_value = first;
}

void clear_commands(Machine *m)
{
    m->report.commands = m->report.others = 0;
    m->ends = false;
}

/* Start as after power-on, at `time_ns`, through the vector table at address 0. */
MACHINE_EXPORT void machine_reset(Machine *m, int64_t time_ns, uint32_t cause)
{
    const uint64_t count = m->state.count;
    make_current(m);
    memset(&m->state, 0, sizeof m->state);
    memset(m->ram, 0, RAM_BYTES);
    m->state.count = m->state.base_count = count;
    m->state.base_ns = m->state.present_ns = time_ns;
    m->state.reset_cause = cause;
    m->state.lowest_sp = m->stack_top;
    m->watching = m->attention = false;
    m->invalid = NO_FAULT;
    m->interrupt = 0;
    clear_commands(m);
    reset_exceptions(m);
    reset_motors(m);
    set_reg(m, UC_ARM_REG_XPSR, 1u << 24);
    for (int name = UC_ARM_REG_R0; name <= UC_ARM_REG_R12; name++) {
        set_reg(m, name, 0);
    }
    set_reg(m, UC_ARM_REG_PRIMASK, 0);
    set_reg(m, UC_ARM_REG_BASEPRI, 0);
    set_reg(m, UC_ARM_REG_CONTROL, 0);
    uint32_t stack = 0, entry = 0;
    read_word(m, FLASH_BASE, &stack);
    read_word(m, FLASH_BASE + 4, &entry);
    set_reg(m, UC_ARM_REG_SP, stack & ~3u);
    set_reg(m, UC_ARM_REG_LR, 0xFFFFFFFFu);
    set_reg(m, UC_ARM_REG_PC, entry | 1u);
    if (!(entry & 1u)) {
        raise_fault(m, USAGE_FAULT, BAD_STATE, entry, entry, 1u << 17);
    }
}

/* The present is `time_ns`: a sleeping machine's instructions count from now on. */
MACHINE_EXPORT void machine_at(Machine *m, int64_t time_ns, int64_t local_ns)
{
    m->state.local_ns = local_ns;
    m->state.present_ns = time_ns;
    if (m->state.asleep || m->cost_num == 0) {
        m->state.base_ns = time_ns;
        m->state.base_count = m->state.count;
    }
}

/* At `time_ns` a frame arrives, or a channel of the timer rings: run until the program sleeps; return a Stop. */
MACHINE_EXPORT uint32_t machine_run_frame(Machine *m, int64_t time_ns, int64_t local_ns, uint64_t instructions,
                                          uint32_t port, const uint8_t *data, uint32_t length)
{
    machine_at(m, time_ns, local_ns);
    machine_receive(m, port, data, length);
    return machine_run(m, INT64_MAX, m->state.count + instructions);
}

MACHINE_EXPORT uint32_t machine_run_ring(Machine *m, int64_t time_ns, int64_t local_ns, uint64_t instructions,
                                         uint32_t channel)
{
    machine_at(m, time_ns, local_ns);
    machine_ring(m, channel);
    return machine_run(m, INT64_MAX, m->state.count + instructions);
}

/* Return how much of the main stack was ever used: to the lowest frame of an exception, or word that is not 0. */
MACHINE_EXPORT uint32_t machine_stack_bytes(Machine *m)
{
    static const uint8_t ZEROS[256];
    uint32_t at = m->stack_low;
    while (at < m->state.lowest_sp) {
        const uint32_t left = m->state.lowest_sp - at, length = left < sizeof ZEROS ? left : sizeof ZEROS;
        const uint8_t *place = ram_at(m, at, length);
        if (place == NULL || memcmp(place, ZEROS, length) != 0) {
            while (place != NULL && *place == 0) {
                place++;
                at++;
            }
            m->state.lowest_sp = at & ~3u;
            break;
        }
        at += length;
    }
    return m->stack_top - m->state.lowest_sp;
}

/* From now on an instruction lasts cost_num / cost_den ns, not 0. */
MACHINE_EXPORT void machine_cost(Machine *m, uint64_t cost_num, uint64_t cost_den)
{
    m->state.base_ns = now_ns(m);
    m->state.base_count = m->state.count;
    m->cost_num = cost_num;
    m->cost_den = cost_den;
}

/* Return the number of instructions executed before `time_ns`, of those of the last run. */
MACHINE_EXPORT uint64_t machine_count_at(const Machine *m, int64_t time_ns)
{
    const uint64_t count = count_at(m, time_ns);
    return count < m->state.count ? count : m->state.count;
}

/* Return the longest time from an interrupt's instant to its entry [ns] since this was asked last. */
MACHINE_EXPORT int64_t machine_latency(Machine *m)
{
    const int64_t latency_ns = m->state.latency_ns;
    m->state.latency_ns = 0;
    return latency_ns;
}

MACHINE_EXPORT void machine_save(Machine *m)
{
    make_current(m);
    if (m->snapshot == NULL) {
        m->snapshot = calloc(1, sizeof *m->snapshot);
        uc_context_alloc(m->uc, &m->snapshot->context);
    }
    uc_context_save(m->uc, m->snapshot->context);
    m->snapshot->state = m->state;
    m->snapshot->ram_bytes = m->engine->ram_bytes;
    memcpy(m->snapshot->ram, m->ram, m->snapshot->ram_bytes);
}

MACHINE_EXPORT void machine_restore(Machine *m)
{
    make_current(m);
    uc_context_restore(m->uc, m->snapshot->context);
    m->state = m->snapshot->state;
    memcpy(m->ram, m->snapshot->ram, m->snapshot->ram_bytes);
    memset(m->ram + m->snapshot->ram_bytes, 0, m->engine->ram_bytes - m->snapshot->ram_bytes);
    clear_commands(m);
    m->attention = false;
    fill_report(m);
}

MACHINE_EXPORT int64_t machine_now(const Machine *m) { return now_ns(m); }
MACHINE_EXPORT Command *machine_commands(Machine *m) { return m->journal.command; }
MACHINE_EXPORT uint8_t *machine_command_bytes(Machine *m) { return m->journal.bytes; }
MACHINE_EXPORT Report *machine_report(Machine *m) { return &m->report; }
MACHINE_EXPORT uint8_t *machine_ram(Machine *m) { return m->ram; }

MACHINE_EXPORT uint32_t machine_register(Machine *m, uint32_t name)
{
    make_current(m);
    return reg(m, (int)name);
}

/* Fill `cause` with cause, program counter, address, r0-r12, sp, lr, pc, xpsr of the last fault, or of now. */
MACHINE_EXPORT void machine_fault(Machine *m, uint32_t *cause)
{
    make_current(m);
    if (m->state.cause == NO_FAULT) {
        note_registers(m, m->pc);
    }
    cause[0] = m->state.cause;
    cause[1] = m->state.cause_registers[15];
    cause[2] = m->state.cause_address;
    memcpy(cause + 3, m->state.cause_registers, sizeof m->state.cause_registers);
}
