/* exceptions.c: the exceptions of ARMv7-M, which Unicorn leaves to its user (ARMv7-M Architecture Reference Manual,
 * B1.5: priorities, entry, return, tail-chaining, escalation, lock-up) and the registers of the system control space.
 *
 *     enter: push frame, mode handler, LR = EXC_RETURN, PC = vector       return: PC = EXC_RETURN pops the frame again
 *
 * Unicorn refuses registers to an unprivileged program, and its interface obeys that: so IPSR is written first, which
 * makes the processor privileged, and CONTROL.nPRIV last.
 *
 * Differs from ARMv7-M: the frame of the FPU is written at entry, never later; the FPU is always enabled; an exception
 * that comes due within an IT block is taken behind it; an unprivileged program's PRIMASK counts as 0.
 */
#include "machine.h"
#include <string.h>

enum {
    CCR_THREAD_FROM_ANY = 1u << 0, CCR_ALIGN = 1u << 9,
    SCR_SLEEP_ON_EXIT = 1u << 1,
    HFSR_VECTOR = 1u << 1, HFSR_FORCED = 1u << 30, HFSR_DEBUG = 1u << 31,
    CFSR_BUS_VALID = 1u << 15, CFSR_STACKING = 1u << 12, CFSR_UNSTACKING = 1u << 11, CFSR_IMPRECISE = 1u << 10,
    CFSR_BAD_RETURN = 1u << 18, CFSR_BAD_STATE = 1u << 17,
    CONTROL_UNPRIVILEGED = 1u, CONTROL_PSP = 2u, CONTROL_FP = 4u,
    XPSR_THUMB = 1u << 24, XPSR_ALIGNED = 1u << 9,
    BASIC_FRAME = 0x20, FP_FRAME = 0x68,
    TICK_ENABLE = 1, TICK_INTERRUPT = 2, TICK_SOURCE = 4, TICK_EXPIRED = 1 << 16,
    IDLE = 256                                  /* priority of a thread, below all others */
};

static const int FIRST_REGISTERS[] = { UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3, UC_ARM_REG_R12,
                                       UC_ARM_REG_LR };

/* --- priorities */

static int group(const State *s, int priority)
{
    return priority < 0 ? priority : priority & ~((2 << s->priority_group) - 1) & 0xFF;
}

static int priority_of(const State *s, int exception)
{
    return exception == RESET ? -3 : exception == NMI ? -2 : exception == HARD_FAULT ? -1 : s->priority[exception];
}

static bool is_enabled(const State *s, int exception)
{
    switch (exception) {
    case MEM_MANAGE: return s->handler_faults & 1u << 16;
    case BUS_FAULT: return s->handler_faults & 1u << 17;
    case USAGE_FAULT: return s->handler_faults & 1u << 18;
    default: return exception < EXTERNAL || s->enabled[exception];
    }
}

/* Return whether any of the flags is set, eight at a time. */
static bool any(const bool *flags)
{
    uint64_t words[EXCEPTIONS / 8], all = 0;
    memcpy(words, flags, sizeof words);
    for (int i = 0; i < EXCEPTIONS / 8; i++) {
        all |= words[i];
    }
    return all != 0;
}

/* Return the pending exception that comes first, 0 if none. */
static int first_pending(const State *s)
{
    int first = 0;
    if (!any(s->pending)) {
        return 0;
    }
    for (int exception = NMI; exception < EXCEPTIONS; exception++) {
        if (s->pending[exception] && is_enabled(s, exception)
            && (first == 0 || priority_of(s, exception) < priority_of(s, first))) {
            first = exception;
        }
    }
    return first;
}

static int active_priority(const State *s)
{
    int least = IDLE;
    if (!any(s->active)) {
        return least;
    }
    for (int exception = NMI; exception < EXCEPTIONS; exception++) {
        if (s->active[exception] && group(s, priority_of(s, exception)) < least) {
            least = group(s, priority_of(s, exception));
        }
    }
    return least;
}

static int with_masks(Machine *m, int priority, bool primask)
{
    const int base = (int)reg(m, UC_ARM_REG_BASEPRI);
    if (base != 0 && group(&m->state, base) < priority) {
        priority = group(&m->state, base);
    }
    if (primask && priority > 0 && reg(m, UC_ARM_REG_PRIMASK) & 1u) {
        priority = 0;
    }
    if (priority > -1 && reg(m, UC_ARM_REG_FAULTMASK) & 1u) {
        priority = -1;
    }
    return priority;
}

static int execution_priority(Machine *m) { return with_masks(m, active_priority(&m->state), true); }

bool masks_allow(Machine *m)
{
    const int first = first_pending(&m->state);
    return first != 0 && group(&m->state, priority_of(&m->state, first)) < execution_priority(m);
}

bool would_wake(Machine *m)
{
    const int first = first_pending(&m->state);
    return first != 0
        && group(&m->state, priority_of(&m->state, first)) < with_masks(m, active_priority(&m->state), false);
}

static void pend(Machine *m, uint32_t exception, int64_t due_ns)
{
    if (!m->state.pending[exception]) {
        m->state.due_ns[exception] = due_ns;
        m->state.pending[exception] = true;
    }
}

void set_line(Machine *m, uint32_t interrupt, bool level, int64_t due_ns)
{
    const uint32_t exception = EXTERNAL + interrupt;
    if (level && !m->state.line[exception] && !m->state.active[exception]) {
        pend(m, exception, due_ns);
        need_attention(m);
    }
    m->state.line[exception] = level;
}

/* Pend what software asks for, now. */
static void pend_bits(Machine *m, uint32_t interrupts)
{
    for (uint32_t i = 0; i < INTERRUPTS; i++) {
        if (interrupts >> i & 1u) {
            pend(m, EXTERNAL + i, now_ns(m));
        }
    }
}

/* --- entry */

static void set_mode(Machine *m, uint32_t xpsr) { set_reg(m, UC_ARM_REG_XPSR_NZCVQG, xpsr); }

static void go_to_vector(Machine *m, int exception)
{
    State *s = &m->state;
    uint32_t handler;
    s->pending[exception] = false;
    s->active[exception] = true;
    if (m->cost_num != 0 && exception >= SYS_TICK && now_ns(m) - s->due_ns[exception] > s->latency_ns) {
        s->latency_ns = now_ns(m) - s->due_ns[exception];
    }
    s->event_register = true;
    m->spent += ENTRY_INSTRUCTIONS;
    if (!read_word(m, s->vector_table + 4u * (uint32_t)exception, &handler)) {
        raise_fault(m, HARD_FAULT, VECTOR_READ, reg(m, UC_ARM_REG_PC), s->vector_table, 0);
        return;
    }
    set_reg(m, UC_ARM_REG_PC, handler | 1u);
    if (!(handler & 1u)) {
        raise_fault(m, USAGE_FAULT, BAD_STATE, handler, handler, CFSR_BAD_STATE);
    }
}

static void enter(Machine *m, int exception)
{
    State *s = &m->state;
    const uint32_t control = reg(m, UC_ARM_REG_CONTROL), xpsr = reg(m, UC_ARM_REG_XPSR), sp = reg(m, UC_ARM_REG_SP);
    const bool thread = (xpsr & 0x1FFu) == 0, fp = control & CONTROL_FP, psp = thread && control & CONTROL_PSP;
    const bool shifted = s->configuration & CCR_ALIGN && sp & 4u;
    const uint32_t size = fp ? FP_FRAME : BASIC_FRAME, frame = sp - size - (shifted ? 4u : 0u);
    uint8_t *place = frame & 3u ? NULL : ram_at(m, frame, size);
    if (place != NULL) {
        uint32_t words[8];
        for (int i = 0; i < 6; i++) {
            words[i] = reg(m, FIRST_REGISTERS[i]);
        }
        words[6] = reg(m, UC_ARM_REG_PC);
        words[7] = (xpsr & ~(uint32_t)XPSR_ALIGNED) | XPSR_THUMB | (shifted ? XPSR_ALIGNED : 0u);
        memcpy(place, words, sizeof words);
        if (fp) {
            const uint32_t tail[2] = { reg(m, UC_ARM_REG_FPSCR), 0 };
            for (int i = 0; i < 8; i++) {
                uc_reg_read(m->uc, UC_ARM_REG_D0 + i, place + 0x20 + 8 * i);
            }
            memcpy(place + 0x60, tail, sizeof tail);
        }
    }
    set_reg(m, UC_ARM_REG_SP, frame);
    if (!psp && frame < s->lowest_sp) {
        s->lowest_sp = frame;
    }
    const uint32_t mode = (xpsr & 0xF80F0000u) | XPSR_THUMB;
    set_mode(m, mode | (uint32_t)exception);
    set_reg(m, UC_ARM_REG_CONTROL, 0);
    if (psp) {
        set_mode(m, mode);
        set_reg(m, UC_ARM_REG_CONTROL, 0);
        set_mode(m, mode | (uint32_t)exception);
    }
    set_reg(m, UC_ARM_REG_CONTROL, control & CONTROL_UNPRIVILEGED);
    set_reg(m, UC_ARM_REG_LR, 0xFFFFFFE1u | (fp ? 0u : 0x10u) | (thread ? 8u : 0u) | (psp ? 4u : 0u));
    go_to_vector(m, exception);
    if (place == NULL) {
        raise_fault(m, BUS_FAULT, STACKING, reg(m, UC_ARM_REG_PC), frame, CFSR_STACKING);
    }
}

/* Enter `exception` from the end of a handler, which has left the frame that `value` describes. */
static void chain(Machine *m, int exception, uint32_t value)
{
    set_mode(m, (reg(m, UC_ARM_REG_XPSR) & 0xF80F0000u) | XPSR_THUMB | (uint32_t)exception);
    set_reg(m, UC_ARM_REG_CONTROL, reg(m, UC_ARM_REG_CONTROL) & CONTROL_UNPRIVILEGED);
    set_reg(m, UC_ARM_REG_LR, value);
    go_to_vector(m, exception);
}

bool take_pending(Machine *m)
{
    State *s = &m->state;
    const int first = first_pending(s);
    m->watching = false;
    if (first == 0) {
        return false;
    }
    const int priority = group(s, priority_of(s, first)), active = active_priority(s);
    if (priority >= active) {
        return false;
    }
    if (priority >= with_masks(m, active, true)) {
        m->watching = true;
        return false;
    }
    enter(m, first);
    return true;
}

/* --- faults and calls */

void note_registers(Machine *m, uint32_t pc)
{
    uint32_t *to = m->state.cause_registers;
    for (int i = 0; i < 13; i++) {
        to[i] = reg(m, UC_ARM_REG_R0 + i);
    }
    to[13] = reg(m, UC_ARM_REG_SP);
    to[14] = reg(m, UC_ARM_REG_LR);
    to[15] = pc;
    to[16] = reg(m, UC_ARM_REG_XPSR);
}

static bool in_fault(const State *s)
{
    return s->active[HARD_FAULT] || s->active[MEM_MANAGE] || s->active[BUS_FAULT] || s->active[USAGE_FAULT];
}

static void remember(Machine *m, Cause cause, uint32_t pc, uint32_t address)
{
    if (!in_fault(&m->state)) {                 /* the first fault is the cause of those in its handler */
        m->state.cause = cause;
        m->state.cause_address = address;
        note_registers(m, pc);
    }
}

/* Return `exception`, or the hard fault that it becomes, or 0 if the processor locks up. */
static int escalated(Machine *m, int exception)
{
    State *s = &m->state;
    const int now = execution_priority(m);
    if (exception != HARD_FAULT && (!is_enabled(s, exception) || group(s, priority_of(s, exception)) >= now)) {
        s->hard_faults |= HFSR_FORCED;
        exception = HARD_FAULT;
    }
    if (exception == HARD_FAULT && now <= -1) {
        s->locked_up = true;
        return 0;
    }
    return exception;
}

void raise_fault(Machine *m, Exception exception, Cause cause, uint32_t pc, uint32_t address, uint32_t status)
{
    State *s = &m->state;
    remember(m, cause, pc, address);
    s->faults |= status;
    if (status & CFSR_BUS_VALID) {
        s->fault_address = address;
    }
    s->hard_faults |= cause == BREAKPOINT ? HFSR_DEBUG : cause == VECTOR_READ ? HFSR_VECTOR : 0u;
    const int taken = escalated(m, exception);
    if (taken == 0) {
        return;
    }
    if (!(status & CFSR_IMPRECISE)) {
        set_reg(m, UC_ARM_REG_PC, pc | 1u);
    }
    enter(m, taken);
}

void call_supervisor(Machine *m, uint32_t pc)
{
    const int taken = escalated(m, SV_CALL);
    if (taken == SV_CALL) {
        enter(m, SV_CALL);
    } else {
        remember(m, CALL_ESCALATED, m->pc, m->pc);
        if (taken != 0) {
            set_reg(m, UC_ARM_REG_PC, pc | 1u);
            enter(m, taken);
        }
    }
}

/* --- return */

static void chain_fault(Machine *m, Exception exception, Cause cause, uint32_t value, uint32_t address, uint32_t status)
{
    remember(m, cause, m->pc, address);
    m->state.faults |= status;
    const int taken = escalated(m, exception);
    if (taken != 0) {
        chain(m, taken, value);
    }
}

void return_from_exception(Machine *m, uint32_t value)
{
    State *s = &m->state;
    const uint32_t leaving = reg(m, UC_ARM_REG_IPSR) & 0x1FFu, to = value & 0xFu;
    const bool fp = !(value & 0x10u), psp = to == 0xDu, handler = to == 0x1u;
    int nested = 0;
    for (int exception = NMI; exception < EXCEPTIONS; exception++) {
        nested += s->active[exception];
    }
    bool valid = (value & 0xFFFFFFE0u) == 0xFFFFFFE0u && (to == 0x1u || to == 0x9u || to == 0xDu)
        && leaving < EXCEPTIONS && s->active[leaving];
    valid = valid && (handler ? nested > 1 : nested == 1 || s->configuration & CCR_THREAD_FROM_ANY);
    if (leaving != NMI) {
        set_reg(m, UC_ARM_REG_FAULTMASK, 0);
    }
    if (leaving < EXCEPTIONS) {
        s->active[leaving] = false;
        if (s->line[leaving]) {
            pend(m, leaving, line_due_ns(m, leaving - EXTERNAL));
        }
    }
    s->event_register = true;
    if (!in_fault(s)) {
        s->cause = NO_FAULT;
    }
    if (!valid) {
        chain_fault(m, USAGE_FAULT, BAD_RETURN, value, value, CFSR_BAD_RETURN);
        return;
    }
    const int next = first_pending(s);
    if (next != 0 && group(s, priority_of(s, next)) < execution_priority(m)) {
        chain(m, next, value);
        return;
    }
    const uint32_t sp = reg(m, psp ? UC_ARM_REG_PSP : UC_ARM_REG_MSP), size = fp ? FP_FRAME : BASIC_FRAME;
    const uint8_t *place = sp & 3u ? NULL : ram_at(m, sp, size);
    if (place == NULL) {
        chain_fault(m, BUS_FAULT, UNSTACKING, value, sp, CFSR_UNSTACKING);
        return;
    }
    uint32_t words[8];
    memcpy(words, place, sizeof words);
    if (((words[7] & 0x1FFu) != 0) != handler) {
        chain_fault(m, USAGE_FAULT, BAD_RETURN, value, words[7], CFSR_BAD_RETURN);
        return;
    }
    const uint32_t after = (sp + size) | (words[7] & XPSR_ALIGNED && s->configuration & CCR_ALIGN ? 4u : 0u);
    const uint32_t unprivileged = reg(m, UC_ARM_REG_CONTROL) & CONTROL_UNPRIVILEGED;
    const uint32_t control = (psp ? CONTROL_PSP : 0u) | (fp ? CONTROL_FP : 0u);
    const uint32_t xpsr = words[7] & ~(uint32_t)XPSR_ALIGNED;
    if (fp) {
        uint32_t status;
        for (int i = 0; i < 8; i++) {
            uc_reg_write(m->uc, UC_ARM_REG_D0 + i, place + 0x20 + 8 * i);
        }
        memcpy(&status, place + 0x60, sizeof status);
        set_reg(m, UC_ARM_REG_FPSCR, status);
    }
    set_reg(m, UC_ARM_REG_CONTROL, 0);
    set_mode(m, (xpsr & ~0x0600FC00u) | XPSR_THUMB);
    set_reg(m, UC_ARM_REG_CONTROL, control);
    set_reg(m, UC_ARM_REG_SP, after);
    for (int i = 0; i < 6; i++) {
        set_reg(m, FIRST_REGISTERS[i], words[i]);
    }
    set_reg(m, UC_ARM_REG_PC, words[6] | 1u);
    set_mode(m, xpsr | XPSR_THUMB);
    set_reg(m, UC_ARM_REG_CONTROL, control | unprivileged);
    if (!(xpsr & XPSR_THUMB)) {
        raise_fault(m, USAGE_FAULT, BAD_STATE, words[6], words[6], CFSR_BAD_STATE);
    } else if (!handler && s->system_control & SCR_SLEEP_ON_EXIT) {
        s->asleep = true;
    }
}

/* --- SysTick */

static int64_t tick_ns(const Machine *m, uint64_t number)
{
    const unsigned __int128 cycles = (unsigned __int128)number * (m->state.tick_reload + 1u);
    return m->state.tick_base_ns + (int64_t)((cycles * m->tick_num + m->tick_den - 1) / m->tick_den);
}

int64_t next_tick_ns(const Machine *m)
{
    return m->state.tick_control & TICK_ENABLE && m->state.tick_reload != 0 ? tick_ns(m, m->state.tick_number + 1)
        : INT64_MAX;
}

void run_tick(Machine *m)
{
    State *s = &m->state;
    if (!(s->tick_control & TICK_ENABLE)) {
        return;
    }
    const int64_t now = now_ns(m);
    while (next_tick_ns(m) <= now) {
        s->tick_number++;
        s->tick_expired = true;
        if (s->tick_control & TICK_INTERRUPT) {
            pend(m, SYS_TICK, tick_ns(m, s->tick_number));
        }
    }
}

static void restart_tick(Machine *m)
{
    m->state.tick_base_ns = now_ns(m);
    m->state.tick_number = 0;
    need_attention(m);
}

static uint32_t tick_value(const Machine *m)
{
    const State *s = &m->state;
    const int64_t next = next_tick_ns(m);
    if (next == INT64_MAX) {
        return 0;
    }
    const unsigned __int128 left = (unsigned __int128)(uint64_t)(next - now_ns(m)) * m->tick_den / m->tick_num;
    return left > s->tick_reload ? s->tick_reload : (uint32_t)left;
}

/* --- the registers */

static uint32_t bits(const bool *flags)
{
    uint32_t word = 0;
    for (int i = 0; i < INTERRUPTS; i++) {
        word |= (uint32_t)flags[EXTERNAL + i] << i;
    }
    return word;
}

static void set_bits(bool *flags, uint32_t word, bool value)
{
    for (int i = 0; i < INTERRUPTS; i++) {
        if (word >> i & 1u) {
            flags[EXTERNAL + i] = value;
        }
    }
}

static uint32_t interrupt_state(Machine *m)
{
    const State *s = &m->state;
    const uint32_t current = reg(m, UC_ARM_REG_IPSR) & 0x1FFu;
    int others = 0;
    bool interrupt = false;
    for (int exception = NMI; exception < EXCEPTIONS; exception++) {
        others += s->active[exception] && (uint32_t)exception != current;
        interrupt |= exception >= EXTERNAL && s->pending[exception];
    }
    return current | (others == 0 ? 1u << 11 : 0u) | (uint32_t)first_pending(s) << 12 | (uint32_t)interrupt << 22
        | (uint32_t)s->pending[SYS_TICK] << 26 | (uint32_t)s->pending[PEND_SV] << 28 | (uint32_t)s->pending[NMI] << 31;
}

static const struct { uint32_t bit; Exception exception; bool active; } HANDLER_BITS[] = {
    { 0, MEM_MANAGE, true }, { 1, BUS_FAULT, true }, { 3, USAGE_FAULT, true }, { 7, SV_CALL, true },
    { 8, DEBUG_MONITOR, true }, { 10, PEND_SV, true }, { 11, SYS_TICK, true }, { 12, USAGE_FAULT, false },
    { 13, MEM_MANAGE, false }, { 14, BUS_FAULT, false }, { 15, SV_CALL, false },
};

static uint32_t handler_state(const State *s)
{
    uint32_t word = s->handler_faults;
    for (uint32_t i = 0; i < sizeof HANDLER_BITS / sizeof *HANDLER_BITS; i++) {
        const int exception = HANDLER_BITS[i].exception;
        word |= (uint32_t)(HANDLER_BITS[i].active ? s->active[exception] : s->pending[exception])
            << HANDLER_BITS[i].bit;
    }
    return word;
}

static uint32_t four_priorities(const uint8_t *first)
{
    return first[0] | (uint32_t)first[1] << 8 | (uint32_t)first[2] << 16 | (uint32_t)first[3] << 24;
}

static uint32_t read_register(Machine *m, uint32_t offset)
{
    State *s = &m->state;
    if (offset >= 0x400 && offset < 0x400 + INTERRUPTS) {
        return four_priorities(s->priority + EXTERNAL + (offset - 0x400));
    }
    switch (offset) {
    case 0x004: return 0;                                       /* ICTR: 32 interrupts */
    case 0x008: return 0;                                       /* ACTLR */
    case 0x010: {
        const uint32_t word = s->tick_control | TICK_SOURCE | (s->tick_expired ? TICK_EXPIRED : 0u);
        s->tick_expired = false;
        return word;
    }
    case 0x014: return s->tick_reload;
    case 0x018: return tick_value(m);
    case 0x01C: return 1u << 31;                                /* SYST_CALIB: no reference clock */
    case 0x100: case 0x180: return bits(s->enabled);
    case 0x200: case 0x280: return bits(s->pending);
    case 0x300: return bits(s->active);
    case 0xD00: return 0x410FC240u;
    case 0xD04: return interrupt_state(m);
    case 0xD08: return s->vector_table;
    case 0xD0C: return 0xFA050000u | s->priority_group << 8;
    case 0xD10: return s->system_control;
    case 0xD14: return s->configuration;
    case 0xD18: return four_priorities(s->priority + 4);
    case 0xD1C: return four_priorities(s->priority + 8);
    case 0xD20: return four_priorities(s->priority + 12);
    case 0xD24: return handler_state(s);
    case 0xD28: return s->faults;
    case 0xD2C: return s->hard_faults;
    case 0xD30: return 0;
    case 0xD34: case 0xD38: return s->fault_address;
    case 0xD3C: return 0;
    case 0xD88: return s->coprocessors;
    case 0xD90: return 0;                                       /* MPU_TYPE: no regions */
    case 0xDF0: case 0xDFC: return 0;                           /* DHCSR, DEMCR: no debugger */
    case 0xF34: return 1u << 31;                                /* FPCCR: the FPU's frame is written at entry */
    case 0xF38: case 0xF3C: return 0;                           /* FPCAR, FPDSCR */
    case 0xF40: return 0x10110021u;
    case 0xF44: return 0x11000011u;
    default:
        trouble(m, UNKNOWN_REGISTER, SYSTEM_BASE + offset);
        return 0;
    }
}

static bool write_register(Machine *m, uint32_t offset, uint32_t value)
{
    State *s = &m->state;
    switch (offset) {
    case 0x008: case 0xD30: case 0xD3C: case 0xDFC: case 0xF34: case 0xF38: case 0xF3C: break;
    case 0x010: {
        const bool starts = value & TICK_ENABLE && !(s->tick_control & TICK_ENABLE);
        s->tick_control = value & (TICK_ENABLE | TICK_INTERRUPT);
        if (starts) {
            restart_tick(m);
        }
        break;
    }
    case 0x014:
        s->tick_reload = value & 0xFFFFFFu;
        restart_tick(m);
        break;
    case 0x018:
        s->tick_expired = false;
        restart_tick(m);
        break;
    case 0x100: set_bits(s->enabled, value, true); break;
    case 0x180: set_bits(s->enabled, value, false); break;
    case 0x200: pend_bits(m, value); break;
    case 0x280:
        set_bits(s->pending, value, false);
        for (int exception = EXTERNAL; exception < EXCEPTIONS; exception++) {
            if (s->line[exception] && !s->active[exception]) {
                pend(m, (uint32_t)exception, line_due_ns(m, (uint32_t)exception - EXTERNAL));
            }
        }
        break;
    case 0xD04:
        s->pending[NMI] |= value >> 31 & 1u;
        s->pending[PEND_SV] = (s->pending[PEND_SV] && !(value >> 27 & 1u)) || value >> 28 & 1u;
        s->pending[SYS_TICK] = s->pending[SYS_TICK] && !(value >> 25 & 1u);
        if (value >> 26 & 1u) {
            pend(m, SYS_TICK, now_ns(m));
        }
        break;
    case 0xD08: s->vector_table = value & 0xFFFFFF80u; break;
    case 0xD0C:
        if (value >> 16 == 0x05FA) {
            s->priority_group = value >> 8 & 7u;
            if (value & 4u) {
                request_reset(m);
            }
        }
        break;
    case 0xD10: s->system_control = value & 0x16u; break;
    case 0xD14: s->configuration = value & 0x31Bu; break;
    case 0xD24:
        s->handler_faults = value & 0x70000u;
        for (uint32_t i = 0; i < sizeof HANDLER_BITS / sizeof *HANDLER_BITS; i++) {
            bool *flags = HANDLER_BITS[i].active ? s->active : s->pending;
            flags[HANDLER_BITS[i].exception] = value >> HANDLER_BITS[i].bit & 1u;
        }
        break;
    case 0xD28: s->faults &= ~value; break;
    case 0xD2C: s->hard_faults &= ~value; break;
    case 0xD34: case 0xD38: s->fault_address = value; break;
    case 0xD88: s->coprocessors = value & 0x00F00000u; break;
    case 0xF00:
        if ((value & 0x1FFu) < INTERRUPTS) {
            pend(m, EXTERNAL + (value & 0x1FFu), now_ns(m));
        }
        break;
    default: return false;
    }
    need_attention(m);
    return true;
}

uint64_t read_system(uc_engine *uc, uint64_t offset, unsigned size, void *user)
{
    Machine *m = user;
    (void)uc;
    if (!privileged(m)) {
        trouble(m, NOT_PRIVILEGED, SYSTEM_BASE + (uint32_t)offset);
        return 0;
    }
    const uint32_t word = read_register(m, (uint32_t)offset & ~3u) >> 8 * (offset & 3u);
    return size == 4 ? word : word & ((1u << 8 * size) - 1u);
}

void write_system(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user)
{
    Machine *m = user;
    uint8_t *priority = NULL;
    (void)uc;
    if (!privileged(m)) {
        trouble(m, NOT_PRIVILEGED, SYSTEM_BASE + (uint32_t)offset);
        return;
    }
    if (offset >= 0x400 && offset + size <= 0x400 + INTERRUPTS) {
        priority = m->state.priority + EXTERNAL + (offset - 0x400);
    } else if (offset >= 0xD18 && offset + size <= 0xD24) {
        priority = m->state.priority + 4 + (offset - 0xD18);
    }
    if (priority != NULL) {
        for (unsigned i = 0; i < size; i++) {
            priority[i] = (uint8_t)(value >> 8 * i);
        }
        need_attention(m);
    } else if (!write_register(m, (uint32_t)offset & ~3u, (uint32_t)value << 8 * (offset & 3u))) {
        trouble(m, UNKNOWN_REGISTER, SYSTEM_BASE + (uint32_t)offset);
    }
}

void reset_exceptions(Machine *m)
{
    m->state.configuration = CCR_ALIGN;
}
