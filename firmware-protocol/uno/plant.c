/* plant: runs the firmware of the stage in simavr, with its serial port on a pty and a carriage on its pins.
 *
 * usage: plant FIRMWARE.elf LINK
 *
 * LINK becomes a symbolic link to the pty. The carriage moves a step at each rising edge of PD2, towards the home
 * switch if PD5 is high; the switch connects PB1 to ground while the carriage is at or below SWITCH_AT steps.
 * Simulated time keeps pace with the clock on the wall; where the machine is too slow, it falls behind.
 * Commands, one a line on stdin, each answered by a line of JSON:
 *   state               how things stand
 *   switch auto|open|closed
 *   reset               as the button does
 *   unplug              the pty hangs up; the board keeps its power
 *   plug                a new pty under LINK
 *   quit
 * Links libsimavr (GPL-3): a tool of its own, not part of epirig. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <pty.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>

enum { CLOCK_HZ = 16000000, STEP_BIT = 2, DIRECTION_BIT = 5, LIMIT_BIT = 1, ENABLE_BIT = 0, SWITCH_AT = -900 };
enum sw { AUTO, OPEN, CLOSED };

static avr_t *avr;
static avr_irq_t *uart_in, *limit_pin;
static int uart_ready = 1, host = -1, device = -1;
static unsigned char out[4096];
static size_t out_length;
static long carriage, lowest, highest;
static int towards_home, powered, closed = -1;
static enum sw sw = AUTO;
static unsigned long steps, unpowered_steps;
static avr_cycle_count_t last_step, shortest_gap;

static void update_switch(void)
{
    int now = sw == AUTO ? carriage <= SWITCH_AT : sw == CLOSED;
    if (now != closed) {
        closed = now;
        /* What is outside holds the pin: without this, each write to PORTB would put it back to its pull-up. */
        avr_ioport_external_t outside = { .name = 'B', .mask = 1 << LIMIT_BIT, .value = !now << LIMIT_BIT };
        avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL('B'), &outside);
        avr_raise_irq(limit_pin, !now);
    }
}

static void on_step(avr_irq_t *irq, uint32_t level, void *unused)
{
    (void)irq; (void)unused;
    if (!level)
        return;
    if (!powered) {
        unpowered_steps++;
        return;
    }
    avr_cycle_count_t gap = avr->cycle - last_step;
    if (!shortest_gap || gap < shortest_gap)
        shortest_gap = gap;
    last_step = avr->cycle;
    steps++;
    carriage += towards_home ? -1 : 1;
    if (carriage < lowest) lowest = carriage;
    if (carriage > highest) highest = carriage;
    update_switch();
}

static void on_direction(avr_irq_t *irq, uint32_t level, void *unused) { (void)irq; (void)unused; towards_home = level; }
static void on_enable(avr_irq_t *irq, uint32_t level, void *unused) { (void)irq; (void)unused; powered = !level; }
static void on_ready(avr_irq_t *irq, uint32_t level, void *unused) { (void)irq; (void)level; (void)unused; uart_ready = 1; }
static void on_full(avr_irq_t *irq, uint32_t level, void *unused) { (void)irq; (void)level; (void)unused; uart_ready = 0; }
static void on_byte(avr_irq_t *irq, uint32_t byte, void *unused)
{
    (void)irq; (void)unused;
    if (host >= 0 && out_length < sizeof out)
        out[out_length++] = byte;
}

static void plug(const char *link)
{
    char name[128];
    struct termios raw;
    if (openpty(&host, &device, name, NULL, NULL)) { perror("openpty"); exit(1); }
    tcgetattr(device, &raw);
    cfmakeraw(&raw);
    tcsetattr(device, TCSANOW, &raw);
    fcntl(host, F_SETFL, O_NONBLOCK);
    unlink(link);
    if (symlink(name, link)) { perror(link); exit(1); }
}

static void unplug(void)
{
    close(host);
    close(device);
    host = device = -1;
    out_length = 0;
}

/* Without this simavr looks at the level of INT0, which is the step pin, every cycle. */
static void quiet_external_interrupt(void) { avr_extint_set_strict_lvl_trig(avr, EXTINT_IRQ_OUT_INT0, 0); }

static void state(const char *command)
{
    printf("{\"command\":\"%s\",\"carriage\":%ld,\"lowest\":%ld,\"highest\":%ld,\"steps\":%lu,\"unpowered_steps\":%lu,"
           "\"switch_closed\":%s,\"shortest_gap_us\":%.1f,\"since_last_step_s\":%.6f,\"simulated_s\":%.6f}\n",
           command, carriage, lowest, highest, steps, unpowered_steps, closed ? "true" : "false",
           shortest_gap / 16.0, (double)(avr->cycle - last_step) / CLOCK_HZ, (double)avr->cycle / CLOCK_HZ);
    fflush(stdout);
}

static void obey(const char *link)
{
    static char line[128];
    static size_t length;
    char byte;
    ssize_t got;
    while ((got = read(0, &byte, 1)) == 1) {
        if (byte != '\n') {
            if (length < sizeof line - 1) line[length++] = byte;
            continue;
        }
        line[length] = 0;
        length = 0;
        if (!strcmp(line, "switch auto")) sw = AUTO;
        else if (!strcmp(line, "switch open")) sw = OPEN;
        else if (!strcmp(line, "switch closed")) sw = CLOSED;
        else if (!strcmp(line, "reset")) {
            avr_reset(avr);
            quiet_external_interrupt();
            powered = 0;
            closed = -1; /* the new input register has to hear of it */
            avr_raise_irq(limit_pin, 0);
            avr_raise_irq(limit_pin, 1);
        }
        else if (!strcmp(line, "unplug")) unplug();
        else if (!strcmp(line, "plug")) plug(link);
        else if (!strcmp(line, "quit")) exit(0);
        else if (strcmp(line, "state")) { printf("{\"unknown\":\"%s\"}\n", line); fflush(stdout); continue; }
        update_switch();
        state(line);
    }
    if (got == 0)
        exit(0); /* whoever started us has gone */
}

static double wall(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec + now.tv_nsec * 1e-9;
}

int main(int count, char **arguments)
{
    elf_firmware_t firmware = {0};
    if (count != 3) { fprintf(stderr, "usage: plant FIRMWARE.elf LINK\n"); return 2; }
    if (elf_read_firmware(arguments[1], &firmware)) { fprintf(stderr, "cannot read %s\n", arguments[1]); return 1; }
    avr = avr_make_mcu_by_name("atmega328p");
    avr_init(avr);
    firmware.frequency = avr->frequency = CLOCK_HZ;
    avr->log = LOG_ERROR;
    avr_load_firmware(avr, &firmware);

    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    uart_in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_byte, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XON), on_ready, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUT_XOFF), on_full, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), STEP_BIT), on_step, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), DIRECTION_BIT), on_direction, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), ENABLE_BIT), on_enable, NULL);
    limit_pin = avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('B'), LIMIT_BIT);
    update_switch();
    quiet_external_interrupt();

    signal(SIGPIPE, SIG_IGN);
    fcntl(0, F_SETFL, fcntl(0, F_GETFL) | O_NONBLOCK);
    plug(arguments[2]);
    state("started");

    double behind_since = wall() - (double)avr->cycle / CLOCK_HZ;
    for (;;) {
        avr_cycle_count_t end = avr->cycle + CLOCK_HZ / 1000;
        while (avr->cycle < end) {
            int what = avr_run(avr);
            if (what == cpu_Done || what == cpu_Crashed) { printf("{\"stopped\":%d}\n", what); return 1; }
        }
        unsigned char byte;
        while (host >= 0 && uart_ready && read(host, &byte, 1) == 1)
            avr_raise_irq(uart_in, byte);
        if (host >= 0 && out_length) {
            ssize_t written = write(host, out, out_length);
            if (written > 0) memmove(out, out + written, out_length -= written);
        }
        obey(arguments[2]);
        double ahead = (double)avr->cycle / CLOCK_HZ - (wall() - behind_since);
        if (ahead > 0) usleep(ahead * 1e6);
        else if (ahead < -0.05) behind_since = wall() - (double)avr->cycle / CLOCK_HZ;
    }
}
