/* marconet_board.h: what a firmware gives to its board, and what the board gives to it.
 *
 *     board --board_start, board_timer, board_receive--> firmware --board_now, board_send, ...--> board
 *
 * The same C99 sources run as a shared library on the host, as an image on an emulated Cortex-M and, with one file that
 * implements the second half of this header over its drivers, on a real board.
 *
 * - The board calls one function of the firmware at a time and waits until it returns (run to completion). What a call
 *   sends, actuates and arms acts at the instant of the call, in the order of the calls of the board's functions.
 * - Nothing here allocates memory. Pointers that the board passes are valid until the function returns; the board copies
 *   what it is passed.
 * - Times are local: nanoseconds on this board's own clock, which drifts and may be set. True time is unknown here.
 * - Numbers of ports, timers, parameters, sensors, actuators, counters, signals and events are in board_ids.h, which is
 *   generated from the firmware's firmware.toml; a name has the same number on all robots of a firmware.
 * - The board's functions return 0, or a positive result where one is documented, or a negative BoardError. UNKNOWN_ID
 *   and NOT_NOW are mistakes of the program: an emulated board also ends the run with a message that names the call.
 */
#ifndef MARCONET_BOARD_H
#define MARCONET_BOARD_H

#include <stdint.h>

#if defined(_WIN32)
#define BOARD_EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define BOARD_EXPORT __attribute__((visibility("default")))
#else
#define BOARD_EXPORT
#endif

#define BOARD_TIMERS 32u                /* timers are numbered 0 to 31; the program gives them their meaning */
#define BOARD_MAX_FRAME_BYTES 2048u     /* longest frame that `board_send` takes; a medium may carry less */
#define BOARD_MAX_DETAIL_BYTES 240u     /* longest text of an event; the rest is cut */
#define BOARD_NEVER INT64_MAX           /* an instant after the end of any run */

typedef enum {
    BOARD_OK = 0,
    BOARD_UNKNOWN_ID = -1,      /* no such port, timer, parameter, ... in board_ids.h */
    BOARD_NOT_NOW = -2,         /* `board_send` within `board_start` */
    BOARD_TOO_LONG = -3,        /* a frame longer than BOARD_MAX_FRAME_BYTES */
    BOARD_NO_VALUE = -4,        /* the plant or the scenario has no such value: an index beyond the end, no plant */
    BOARD_OUT_OF_RANGE = -5,    /* an argument outside the range that its function documents */
    BOARD_BUSY = -6             /* no room: too many calls within one activation; a transmitter whose FIFO is full */
} BoardError;

/* --- what the firmware exports */

/* Called once, when the board boots: read parameters, arm the first timers. It sends no frame. A value other than 0
 * refuses to start; the run ends with a message that has the value. Variables are as the C language initializes them. */
BOARD_EXPORT int32_t board_start(void);

/* Called when the timer that `board_set_timer` or `board_set_delay` armed is due; it is not armed any more. */
BOARD_EXPORT void board_timer(uint32_t timer);

/* Called when a frame has arrived at `port`, 0 <= length <= BOARD_MAX_FRAME_BYTES; the bytes may be anything.
 * At one instant arrivals precede timers. On a CAN bus the frame is a `struct can_frame` of SocketCAN, little endian:
 * identifier and flags (u32), length (u8), 3 bytes 0, 8 data bytes; with CAN FD a `struct canfd_frame` of 72 bytes. */
BOARD_EXPORT void board_receive(uint32_t port, const uint8_t *data, uint32_t length);

/* --- time */

/* Return the local time [ns]. It is constant within one call of the firmware unless `board_adjust_clock` changes it. */
int64_t board_now(void);

#define BOARD_SILENT 1u         /* flag: this timer leads to no frame, at once or before another timer does */

/* Arm `timer` to ring when the clock reads at least `local_ns`, at once if it does already; a timer that is armed is
 * set anew. If the clock is set back meanwhile, the timer waits until the clock reads `local_ns`.
 * From the timers without BOARD_SILENT follows the promise of silence: the board sends nothing before the first. */
int32_t board_set_timer(uint32_t timer, int64_t local_ns, uint32_t flags);

/* Arm `timer` to ring `delay_ns` from now by another clock than the local one, as a transmitter's "frame sent"
 * interrupt does; 0 <= delay_ns. Flags as above. */
int32_t board_set_delay(uint32_t timer, int64_t delay_ns, uint32_t flags);

/* Disarm `timer`; without effect if it is not armed. */
int32_t board_cancel_timer(uint32_t timer);

/* Set the clock forward by `step_ns` and let it run `trim_ppm` faster from now on; |trim_ppm| < 1e6. Armed timers keep
 * the instants for which they were armed, so adjust the clock first and set timers afterwards. */
int32_t board_adjust_clock(int64_t step_ns, double trim_ppm);

#define BOARD_FIRM 1u           /* flag: whatever arrives until then */

/* Promise to send nothing before `local_ns`, or before a frame arrives if that is earlier and BOARD_FIRM is not set.
 * It extends the promise that follows from the timers; a frame sent within a promise ends the run. A port that
 * firmware.toml calls `listen_only` ends no promise: what arrives there makes the firmware send nothing earlier. */
int32_t board_promise(int64_t local_ns, uint32_t flags);

/* --- frames and random numbers */

/* Send `length` bytes at `port` now. */
int32_t board_send(uint32_t port, const uint8_t *data, uint32_t length);

/* Return 32 random bits, from this robot's own stream of the scenario. */
uint32_t board_random(void);

/* --- the plant */

/* Read the value of `sensor` at the present; the entries of an array have successive numbers. */
int32_t board_sense(uint32_t sensor, double *value);

/* Set the input `actuator` of the plant from now on. */
int32_t board_actuate(uint32_t actuator, double value);

/* --- parameters, constant over a run */

/* Return the number of values of `parameter`: 1, or the length of its list. */
int32_t board_parameter_length(uint32_t parameter);

/* Read the value `index` of `parameter`. Times are in ns, truth values 0 or 1; whole numbers are exact up to 2^53. */
int32_t board_parameter(uint32_t parameter, uint32_t index, double *value);

/* --- records of the run; a real board may leave these functions empty */

/* Add `by` to `counter`. */
int32_t board_count(uint32_t counter, uint32_t by);

/* Let `signal` have `value` from now on; the records hold its value at each sample instant, 0 before the first call. */
int32_t board_record(uint32_t signal, double value);

/* Record an event at the present; `detail` is text in UTF-8, ended by a 0 byte. */
int32_t board_event(uint32_t event, const char *detail);

#endif
