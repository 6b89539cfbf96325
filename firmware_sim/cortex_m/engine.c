/* engine.c: Unicorn's Cortex-M4 with its memories, which stops at exact instructions or at ends of blocks.
 *
 * An instruction is counted in a hook before it executes; the hook also stops it. Unicorn finishes an IT block before
 * it stops, so a stop within one is late by up to three instructions, always the same ones. A run by blocks counts when
 * a block of code begins.
 * Memory: flash is not writable, RAM is not executable; all else faults.
 *
 * Boards of this process that run the same image by blocks share an engine, so that its code is translated once and
 * stays in the caches of the computer. One board at a time is `current`; registers and RAM of the others are kept aside.
 * Beyond the RAM that the image declares the RAM is read-only until a program writes there, so that boards and snapshots
 * need not copy it.
 *
 * Invariant: the RAM of a board is 0 beyond `ram_bytes` of its engine.
 */
#include "machine.h"
#include <stdlib.h>
#include <string.h>

#define TRANSLATION_BYTES (16u << 20)
#define PAGE_BYTES 0x1000u

static Engine *shared;                          /* the first of those that boards share, as the whole process knows it */

/* --- hooks */

void stop(Machine *m)
{
    m->stopping = true;
    uc_emu_stop(m->uc);
}

static void on_instruction(uc_engine *uc, uint64_t address, uint32_t size, void *user)
{
    Machine *m = ((Engine *)user)->current;
    (void)uc;
    (void)size;
    if (m->state.count >= m->stop_at
        && (m->attention || m->state.count >= m->limit || (m->watching && masks_allow(m)))) {
        stop(m);
    }
    m->state.count++;
    m->pc = (uint32_t)address;
}

uint32_t bytes_of(const Machine *m, uint32_t address)
{
    uint16_t code = 0;
    if (address - FLASH_BASE <= FLASH_BYTES - 2) {
        memcpy(&code, m->flash + (address - FLASH_BASE), 2);
    }
    return code >> 11 >= 0x1D ? 4u : 2u;
}

uint32_t instructions_of(Machine *m, uint32_t address, uint32_t bytes)
{
    Block *known = m->engine->block + (address >> 1) % BLOCKS;
    if (known->address != address || known->bytes != bytes) {
        uint16_t instructions = 0;
        for (uint32_t at = 0; at < bytes; at += bytes_of(m, address + at)) {
            instructions++;
        }
        *known = (Block){ address, (uint16_t)bytes, instructions };
    }
    return known->instructions;
}

static void on_block(uc_engine *uc, uint64_t address, uint32_t bytes, void *user)
{
    Machine *m = ((Engine *)user)->current;
    (void)uc;
    m->pc = (uint32_t)address;
    if (m->state.count >= m->stop_at
        && (m->attention || m->state.count >= m->limit || (m->watching && masks_allow(m)))) {
        m->block_bytes = 0;
        stop(m);
    } else {
        m->block_bytes = bytes;
        m->state.count += instructions_of(m, m->pc, bytes);
    }
}

static void on_interrupt(uc_engine *uc, uint32_t number, void *user)
{
    Machine *m = ((Engine *)user)->current;
    (void)uc;
    m->interrupt = number + 1;
    stop(m);
}

/* In a run by blocks, find the instruction that Unicorn stops before, and take it and those behind it from the count. */
static void find_instruction(Machine *m)
{
    const uint32_t pc = reg(m, UC_ARM_REG_PC) & ~1u;
    if (m->by_blocks && pc - m->pc < m->block_bytes) {
        m->state.count -= instructions_of(m, pc, m->pc + m->block_bytes - pc) - 1u;
        m->pc = pc;
    }
}

static bool on_invalid_instruction(uc_engine *uc, void *user)
{
    Machine *m = ((Engine *)user)->current;
    (void)uc;
    find_instruction(m);
    m->invalid = UNDEFINED;
    m->invalid_address = m->pc;
    return false;
}

/* A program or debugger writes into RAM that the image does not declare: let it, and copy all of the RAM from now on. */
bool grow(Engine *e, uint32_t address)
{
    const uint32_t first = RAM_BASE + e->ram_bytes;
    if (address < first || address >= RAM_BASE + RAM_BYTES
        || uc_mem_protect(e->uc, first, RAM_BYTES - e->ram_bytes, UC_PROT_READ | UC_PROT_WRITE) != UC_ERR_OK) {
        return false;
    }
    e->ram_bytes = RAM_BYTES;
    return true;
}

static bool on_invalid_access(uc_engine *uc, uc_mem_type type, uint64_t address, int size, int64_t value, void *user)
{
    Engine *e = user;
    Machine *m = e->current;
    (void)uc;
    (void)size;
    (void)value;
    if (type == UC_MEM_WRITE_PROT && grow(e, (uint32_t)address)) {
        return true;
    }
    if (m->invalid == NO_FAULT) {
        find_instruction(m);
        m->invalid = type == UC_MEM_FETCH_UNMAPPED || type == UC_MEM_FETCH_PROT ? BAD_FETCH
            : type == UC_MEM_WRITE_PROT ? FLASH_WRITE : type == UC_MEM_WRITE_UNMAPPED ? UNMAPPED_WRITE : UNMAPPED_READ;
        m->invalid_address = (uint32_t)address;
    }
    return false;
}

static uint64_t on_device_read(uc_engine *uc, uint64_t offset, unsigned size, void *user)
{
    return read_device(uc, offset, size, ((Engine *)user)->current);
}

static void on_device_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user)
{
    write_device(uc, offset, size, value, ((Engine *)user)->current);
}

static uint64_t on_system_read(uc_engine *uc, uint64_t offset, unsigned size, void *user)
{
    return read_system(uc, offset, size, ((Engine *)user)->current);
}

static void on_system_write(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user)
{
    write_system(uc, offset, size, value, ((Engine *)user)->current);
}

/* --- engines */

static void free_engine(Engine *e)
{
    if (e->uc != NULL) {
        uc_close(e->uc);
    }
    if (e->fresh != NULL) {
        uc_context_free(e->fresh);
    }
    free(e->flash);
    free(e->ram);
    free(e->block);
    free(e);
}

static bool open_processor(Engine *e)
{
    uc_hook hook;
    if (uc_open(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS, &e->uc) != UC_ERR_OK) {
        return false;
    }
    uc_ctl_set_cpu_model(e->uc, UC_CPU_ARM_CORTEX_M4);
    uc_ctl_set_tcg_buffer_size(e->uc, TRANSLATION_BYTES);
    return uc_mem_map_ptr(e->uc, FLASH_BASE, FLASH_BYTES, UC_PROT_READ | UC_PROT_EXEC, e->flash) == UC_ERR_OK
        && uc_mem_map_ptr(e->uc, RAM_BASE, RAM_BYTES, UC_PROT_READ | UC_PROT_WRITE, e->ram) == UC_ERR_OK
        && uc_mmio_map(e->uc, DEVICES_BASE, DEVICES_BYTES, on_device_read, e, on_device_write, e) == UC_ERR_OK
        && uc_mmio_map(e->uc, SYSTEM_BASE, SYSTEM_BYTES, on_system_read, e, on_system_write, e) == UC_ERR_OK
        && uc_hook_add(e->uc, &e->counting, UC_HOOK_CODE, (void *)on_instruction, e, 1, 0) == UC_ERR_OK
        && uc_hook_add(e->uc, &hook, UC_HOOK_INTR, (void *)on_interrupt, e, 1, 0) == UC_ERR_OK
        && uc_hook_add(e->uc, &hook, UC_HOOK_INSN_INVALID, (void *)on_invalid_instruction, e, 1, 0) == UC_ERR_OK
        && uc_hook_add(e->uc, &hook, UC_HOOK_MEM_INVALID, (void *)on_invalid_access, e, 1, 0) == UC_ERR_OK;
}

static void join(Machine *m, Engine *e)
{
    e->users++;
    m->engine = e;
    m->uc = e->uc;
    m->flash = e->flash;
}

bool new_engine(Machine *m)
{
    Engine *e = calloc(1, sizeof *e);
    if (e == NULL) {
        return false;
    }
    e->flash = calloc(1, FLASH_BYTES);
    e->ram = calloc(1, RAM_BYTES);
    if (!e->flash || !e->ram || !open_processor(e)) {
        free_engine(e);
        return false;
    }
    join(m, e);
    m->ram = e->ram;
    e->ram_bytes = RAM_BYTES;
    e->current = m;
    return true;
}

bool declare_ram(Engine *e, uint32_t ram_bytes)
{
    e->ram_bytes = (ram_bytes + PAGE_BYTES - 1) / PAGE_BYTES * PAGE_BYTES;
    return uc_mem_unmap(e->uc, RAM_BASE, RAM_BYTES) == UC_ERR_OK
        && uc_mem_map_ptr(e->uc, RAM_BASE, e->ram_bytes, UC_PROT_READ | UC_PROT_WRITE, e->ram) == UC_ERR_OK
        && (e->ram_bytes == RAM_BYTES
            || uc_mem_map_ptr(e->uc, RAM_BASE + e->ram_bytes, RAM_BYTES - e->ram_bytes, UC_PROT_READ,
                              e->ram + e->ram_bytes) == UC_ERR_OK);
}

/* Let boards share this engine, which no program has used yet. */
static bool open_for_others(Engine *e)
{
    e->block = calloc(BLOCKS, sizeof *e->block);
    return e->block != NULL && uc_context_alloc(e->uc, &e->fresh) == UC_ERR_OK
        && uc_context_save(e->uc, e->fresh) == UC_ERR_OK && uc_hook_del(e->uc, e->counting) == UC_ERR_OK
        && uc_hook_add(e->uc, &e->counting, UC_HOOK_BLOCK, (void *)on_block, e, 1, 0) == UC_ERR_OK;
}

bool share_engine(Machine *m)
{
    Engine *e = shared;
    m->kept = calloc(1, RAM_BYTES);
    if (m->kept == NULL) {
        return false;
    }
    while (e != NULL && memcmp(e->flash, m->flash, FLASH_BYTES) != 0) {
        e = e->next;
    }
    if (e == NULL) {
        e = m->engine;
        if (!open_for_others(e)) {
            return false;
        }
        e->next = shared;
        shared = e;
        e->current = NULL;
    } else {
        free_engine(m->engine);
        join(m, e);
    }
    m->ram = m->kept;
    return uc_context_alloc(e->uc, &m->context) == UC_ERR_OK && uc_context_save(e->uc, m->context) == UC_ERR_OK;
}

void make_current(Machine *m)
{
    Engine *e = m->engine;
    Machine *before = e->current;
    if (before == m) {
        return;
    }
    if (before != NULL) {
        uc_context_save(e->uc, before->context);
        memcpy(before->kept, e->ram, e->ram_bytes);
        before->ram = before->kept;
    }
    uc_context_restore(e->uc, m->began ? m->context : e->fresh);
    memcpy(e->ram, m->kept, e->ram_bytes);
    m->ram = e->ram;
    m->began = true;
    e->current = m;
}

void leave_engine(Machine *m)
{
    Engine *e = m->engine;
    if (m->context != NULL) {
        uc_context_free(m->context);
    }
    free(m->kept);
    if (e == NULL) {
        return;
    }
    if (e->current == m) {
        e->current = NULL;
    }
    if (--e->users == 0) {
        for (Engine **at = &shared; *at != NULL; at = &(*at)->next) {
            if (*at == e) {
                *at = e->next;
                break;
            }
        }
        free_engine(e);
    }
}
