/* machine.h: a microcontroller with a Cortex-M4F: what its C files share.
 *
 *     machine.c     the loop that runs the processor
 *     engine.c      Unicorn, memory, hooks; what boards of one image share
 *     exceptions.c  exceptions of ARMv7-M: priorities, entry, return, system control registers
 *     devices.c     registers of timers, plant, parameters, records
 *     ports.c       registers of ports
 *     motor.c       registers of encoders and PWM stages
 *     debug.c       what a debugger does with a machine that does not run
 *
 * `State` is all that a program can observe or change, except the bytes of memories and FIFOs: a copy of it, of the
 * processor's registers and of the RAM is a snapshot. machine.py knows the layout of Command and Report.
 */
#ifndef MACHINE_H
#define MACHINE_H

#include <stdbool.h>
#include <stdint.h>
#include <unicorn/unicorn.h>

#if defined(_WIN32)
#define MACHINE_EXPORT __declspec(dllexport)
#else
#define MACHINE_EXPORT __attribute__((visibility("default")))
#endif

#define FLASH_BASE 0x00000000u
#define FLASH_BYTES 0x00080000u
#define RAM_BASE 0x20000000u
#define RAM_BYTES 0x00020000u
#define DEVICES_BASE 0x40000000u
#define DEVICES_BYTES 0x00020000u
#define SYSTEM_BASE 0xE000E000u
#define SYSTEM_BYTES 0x1000u

enum {
    INTERRUPTS = 32, EXCEPTIONS = 16 + INTERRUPTS, PORTS = 8, MOTORS = 8, TIMERS = 32, FILTERS = 14,
    IRQ_TIMER = 0, IRQ_PORT = 8,                /* of port 0; port p has IRQ_PORT + p */
    FRAME_BYTES = 2048, RX_FRAMES = 32, RX_BYTES = 16384,
    ENTRY_INSTRUCTIONS = 200,                   /* an exception's entry in the budget */
    COMMANDS = 256, COMMAND_BYTES = 16384, DETAIL_BYTES = 240, BLOCKS = 4096
};

typedef enum {
    RESET = 1, NMI = 2, HARD_FAULT = 3, MEM_MANAGE = 4, BUS_FAULT = 5, USAGE_FAULT = 6, SV_CALL = 11, DEBUG_MONITOR = 12,
    PEND_SV = 14, SYS_TICK = 15, EXTERNAL = 16
} Exception;

typedef enum {                                  /* why machine_run returned */
    SLEEPS = 0, HAS_COMMANDS = 1, REACHED_LIMIT = 2, LOCKED_UP = 3, BROKEN = 4, HALTED = 5
} Stop;

typedef enum {                                  /* cause of the last fault */
    NO_FAULT, UNMAPPED_READ, UNMAPPED_WRITE, BAD_FETCH, FLASH_WRITE, UNDEFINED, UNKNOWN_REGISTER, BAD_STATE, BAD_RETURN,
    STACKING, UNSTACKING, BREAKPOINT, CALL_ESCALATED, VECTOR_READ, NOT_PRIVILEGED, READ_ONLY_REGISTER, ENGINE
} Cause;

typedef enum {                                  /* what a program asks of the world outside the machine */
    SEND, SET_TIMER, SET_DELAY, CANCEL_TIMER, PROMISE, ACTUATE, COUNT, EVENT, MISTAKE,      /* Operation of the host's */
    RECORD, DRIVE, WATCHDOG, CAPTURE, END, RESTART, ADJUST_CLOCK, SENSE, RANDOM, ENCODER,   /* from END on they stop */
    HAND_OVER                                   /* to `ask` only: carry out the commands so far */
} CommandKind;

typedef struct {
    uint32_t kind;
    uint32_t id;
    int64_t integer;                            /* time, number, flags; for bytes their length */
    int64_t place;                              /* first byte in `bytes`; flags of a timer */
    double real;
} Command;

typedef struct {
    uint32_t first, length;                     /* place of a frame in the ring `rx_bytes` */
    int64_t arrived_ns;
} Frame;

typedef struct {
    uint32_t control;
    uint32_t rx_head, rx_frames;                /* first frame waiting, number of frames waiting */
    uint32_t rx_next, rx_used;                  /* place of the next byte to be stored, bytes in use */
    uint32_t rx_read;                           /* bytes of the first frame that have been read */
    uint32_t rx_lost, tx_length, tx_overflow;
    uint32_t can_tx[4];                         /* identifier, length, data */
    uint32_t filters, filter_id[FILTERS], filter_mask[FILTERS];
    Frame frame[RX_FRAMES];
} PortState;

typedef struct {
    int64_t turned, offset;                     /* counts at the last capture; what the program added */
    uint32_t reload;
    bool down;
} EncoderState;

typedef struct {
    uint32_t period, compare, control;
} PwmState;

typedef struct {
    /* exceptions */
    uint8_t priority[EXCEPTIONS];
    bool enabled[EXCEPTIONS], pending[EXCEPTIONS], active[EXCEPTIONS], line[EXCEPTIONS];
    uint32_t vector_table, priority_group, system_control, configuration, handler_faults, faults, hard_faults;
    uint32_t fault_address, coprocessors;
    bool asleep, event_register;
    int64_t due_ns[EXCEPTIONS];                 /* instant at which a pending exception came due */
    int64_t latency_ns;                         /* longest time from there to its entry, interrupts only */
    uint32_t lowest_sp;                         /* of the main stack, as far as known */
    /* SysTick: the k-th expiry since `tick_base_ns` */
    uint32_t tick_control, tick_reload;
    bool tick_expired;
    int64_t tick_base_ns;
    uint64_t tick_number;
    /* time: instruction number `base_count` begins at `base_ns` */
    uint64_t count, base_count;
    int64_t base_ns;
    int64_t present_ns;                         /* of what happens to the board */
    int64_t local_ns;                           /* local clock, as captured */
    /* the fault that was raised last, for the message that ends a node */
    uint32_t cause, cause_address, cause_registers[17];
    uint32_t trouble;                           /* an imprecise fault to be raised: its Cause */
    uint32_t trouble_address, trouble_pc;
    bool locked_up;
    /* devices */
    uint32_t timer_channel, timer_status, random_value, sense_status, parameter, parameter_index, detail_length;
    uint32_t reset_cause;
    int64_t rang_ns[TIMERS];
    int64_t timer_compare, clock_step, promise_until;
    int64_t clock_trim, sense_value, actuate_value, record_value;   /* bits of a double; record_value also a number */
    PortState port[PORTS];
    uint32_t encoder_asked;
    EncoderState encoder[MOTORS];
    PwmState pwm[MOTORS];
} State;

typedef struct {                                /* what machine.py reads after a run, and writes as an answer */
    uint64_t count;                             /* instructions executed */
    int64_t next_tick_ns;
    int64_t local_ns;                           /* answer: local time after the request */
    uint32_t commands, others;                  /* commands noted; those of them after MISTAKE in CommandKind */
    int32_t status;                             /* answer: 0 or BOARD_NO_VALUE */
    uint32_t wakers;                            /* interrupts that are on: bit 0 the timer's, bit 1 that of a port */
} Report;

typedef double (*Ask)(uint32_t kind, uint32_t id, int64_t integer, double real);

typedef struct {                                /* a block of code without a jump, from `address` on */
    uint32_t address;
    uint16_t bytes, instructions;
} Block;

typedef struct {
    uint8_t *bytes;                             /* frames and texts of the commands */
    Command command[COMMANDS];
    uint32_t bytes_used;                        /* report.commands says how many commands there are */
} Journal;

typedef struct Engine {
    uc_engine *uc;
    uint8_t *flash, *ram;
    struct Machine *current;                    /* the board whose registers and RAM these are */
    uint32_t users;
    uc_hook counting;
    Block *block;                               /* known blocks, by address */
    uc_context *fresh;                          /* registers of a processor that has not run */
    uint32_t ram_bytes;                         /* of RAM that is in use */
    struct Engine *next;
} Engine;

typedef struct Machine {
    Engine *engine;
    uc_engine *uc;                              /* the engine's */
    uint64_t stop_at;                           /* the hook looks closer from this count on */
    uint64_t limit;
    uint64_t spent;                             /* of the budget, by entries of exceptions */
    uint32_t pc;                                /* of the instruction that runs, or ran last */
    bool stopping;                              /* the hook has asked Unicorn to stop */
    bool attention;                             /* the loop has something to do before the next instruction */
    bool watching;                              /* an exception waits for PRIMASK, BASEPRI or FAULTMASK to change */
    bool each_command_stops;
    bool halted;                                /* a breakpoint has asked Unicorn to stop */
    bool ends;                                  /* the program ended its run or reset the processor */
    uint32_t interrupt;                         /* what UC_HOOK_INTR told: 0 nothing */
    uint32_t invalid;                           /* what a memory or instruction hook told: a Cause */
    uint32_t invalid_address;
    State state;
    Journal journal;
    Command dropped;                            /* one that found no room */
    uint8_t *flash, *ram;
    uint64_t tick_num, tick_den;                /* one cycle lasts tick_num / tick_den ns */
    uint64_t cost_num, cost_den;                /* one instruction lasts cost_num / cost_den ns; 0: no time */
    uint32_t id[4];
    uint32_t ports, port_kind[PORTS];
    uint32_t encoders, counts_per_revolution[MOTORS], pwms;
    uint32_t stack_low, stack_top;              /* addresses of the main stack */
    uint32_t parameters;
    const double *values;
    const uint32_t *first_value;
    uint8_t (*rx_bytes)[RX_BYTES];
    uint8_t (*tx_bytes)[FRAME_BYTES];
    uint8_t detail[DETAIL_BYTES];
    struct Snapshot *snapshot;
    struct Debugger *debugger;                  /* NULL without breakpoints */
    Ask ask;                                    /* answers requests while the program waits; NULL: the machine stops */
    bool by_blocks;                             /* stops at ends of blocks, not at exact instructions */
    uint32_t block_bytes;                       /* of the block that `pc` begins */
    uint8_t *kept;                              /* RAM while another board is current; NULL: the engine is its own */
    uc_context *context;                        /* likewise */
    bool began;                                 /* `context` holds its registers */
    Report report;
} Machine;

/* machine.c */
uint32_t reg(Machine *m, int name);
void set_reg(Machine *m, int name, uint32_t value);
uint8_t *ram_at(Machine *m, uint32_t address, uint32_t length);     /* NULL outside the RAM */
bool read_word(Machine *m, uint32_t address, uint32_t *word);       /* false outside flash and RAM */
int64_t now_ns(const Machine *m);
void need_attention(Machine *m);
bool privileged(Machine *m);
void trouble(Machine *m, Cause cause, uint32_t address);
void clear_commands(Machine *m);
void fill_report(Machine *m);

/* engine.c */
bool new_engine(Machine *m);
bool declare_ram(Engine *e, uint32_t ram_bytes);                    /* before a program has run */
bool grow(Engine *e, uint32_t address);         /* let RAM that the image does not declare be written */
bool share_engine(Machine *m);
void make_current(Machine *m);                  /* before its registers or RAM are used */
void leave_engine(Machine *m);
void stop(Machine *m);
uint32_t bytes_of(const Machine *m, uint32_t address);              /* of an instruction */
uint32_t instructions_of(Machine *m, uint32_t address, uint32_t bytes);

/* exceptions.c */
void reset_exceptions(Machine *m);
bool take_pending(Machine *m);                  /* enter the exception that is due; false if none is */
bool would_wake(Machine *m);                     /* whether an exception ends `wfi`: PRIMASK does not hinder it */
void raise_fault(Machine *m, Exception exception, Cause cause, uint32_t pc, uint32_t address, uint32_t status);
void note_registers(Machine *m, uint32_t pc);    /* for the message that ends a node */
void call_supervisor(Machine *m, uint32_t pc);
void return_from_exception(Machine *m, uint32_t value);
bool masks_allow(Machine *m);
void set_line(Machine *m, uint32_t interrupt, bool level, int64_t due_ns);
void run_tick(Machine *m);                      /* let SysTick expire as often as it has up to now */
int64_t next_tick_ns(const Machine *m);         /* INT64_MAX if it does not run */
uint64_t read_system(uc_engine *uc, uint64_t offset, unsigned size, void *user);
void write_system(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user);

/* ports.c */
uint32_t read_port(Machine *m, uint32_t number, uint32_t offset, unsigned size);
void write_port(Machine *m, uint32_t number, uint32_t offset, uint32_t value, unsigned size);

/* motor.c */
uint32_t read_encoder(Machine *m, uint32_t offset);
void write_encoder(Machine *m, uint32_t offset, uint32_t value);
void capture_encoder(Machine *m, double angle /* [rad] */);         /* the answer to a request ENCODER */
uint32_t read_pwm(Machine *m, uint32_t offset);
void write_pwm(Machine *m, uint32_t offset, uint32_t value);
void reset_motors(Machine *m);

/* devices.c */
Command *command(Machine *m, CommandKind kind, uint32_t id, int64_t integer);
Command *command_bytes(Machine *m, CommandKind kind, uint32_t id, const void *data, uint32_t length);
void request(Machine *m, CommandKind kind, uint32_t id, int64_t integer, double real);
int64_t line_due_ns(const Machine *m, uint32_t interrupt);          /* since when a device asks for its interrupt */
void request_reset(Machine *m);
MACHINE_EXPORT void machine_receive(Machine *m, uint32_t number, const uint8_t *data, uint32_t length);
MACHINE_EXPORT void machine_ring(Machine *m, uint32_t channel);
MACHINE_EXPORT void machine_answer(Machine *m, uint32_t kind, int32_t status, double real, int64_t local_ns);
uint64_t read_device(uc_engine *uc, uint64_t offset, unsigned size, void *user);
void write_device(uc_engine *uc, uint64_t offset, unsigned size, uint64_t value, void *user);

#endif
