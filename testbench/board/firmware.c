/* Runs the exported controller on a simulated board and prints, per step, what it commanded and the cycles
   that it took. The same file on a PC prints the same commands, without cycles. */
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "ffc.h"

#define STEPS 1200u
#define CANARY 0xc5u

static ffc_controller controller;
static ffc_sample sample;

/* What a servo would report, in its own counts; integers, so that every machine makes the same. */
static uint32_t seed = 1;

static int16_t draw(int16_t span)
{
    seed = seed * 1664525UL + 1013904223UL;
    return (int16_t)((int32_t)((seed >> 16) % (uint32_t)(2 * span + 1)) - span);
}

static void measure(uint16_t k)
{
    static int16_t wanted, velocity, pushed, push;
    static int32_t position;
    if (k % 40u == 0u) {
        wanted = draw(1) == 0 ? 0 : draw(60);
        pushed = k < 30u ? 0 : draw(120);
    }
    /* fingers close and open in a tenth of a second or two, and a payload that is lost falls at once */
    if (controller.state == FFC_TARING)
        pushed = 0;
    push = (int16_t)(push < pushed ? push + 6 : push > pushed ? push - 6 : push);
    velocity = (int16_t)(velocity + (wanted - velocity) / 4);
    if (wanted == 0 && velocity > -4 && velocity < 4)
        velocity = 0;
    position += velocity * 157L;
    sample.position = (float)(position / 1000) * 0.0015339808f;
    sample.velocity = (float)velocity * 0.02398082f;
    sample.current = (float)(55 + velocity / 4 - push / 2 + draw(2)) * 0.00269f;
    sample.payload = 0.4f;
    /* the second half is tilted anew at every step, which costs two cosines */
    sample.tilt_alpha = k < STEPS / 2u ? 0.3f : (float)draw(100) * 0.002f;
    sample.tilt_beta = -0.1f;
    sample.temperature = 25.0f + (float)(k / 100u);
    sample.has_temperature = true;
    sample.time_us += 10000u + (uint32_t)draw(400);
    sample.has_time = true;
}

#ifdef __AVR__
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

static int put(char letter, FILE *stream)
{
    (void)stream;
    while (!(UCSR0A & (1 << UDRE0)))
        ;
    UDR0 = (uint8_t)letter;
    return 0;
}

static FILE serial = FDEV_SETUP_STREAM(put, NULL, _FDEV_SETUP_WRITE);

static void begin(void)
{
    UCSR0A = 1 << U2X0;
    UBRR0 = 0;
    UCSR0B = 1 << TXEN0;
    stdout = &serial;
    TCCR1A = 0;
    TCCR1B = 1 << CS10; /* every cycle */
}

static void end(void)
{
    cli();
    sleep_enable();
    sleep_cpu(); /* with interrupts off: the simulator stops */
}

/* Fill what lies between the static data and the stack, so that one can see how deep the stack grew. */
extern uint8_t _end;

static void __attribute__((noinline)) paint(void)
{
    for (uint8_t *at = &_end; at < (uint8_t *)SP - 8; at++)
        *at = CANARY;
}

static uint16_t __attribute__((noinline)) depth(void)
{
    const uint8_t *at = &_end;
    while (at < (const uint8_t *)SP && *at == CANARY)
        at++;
    return (uint16_t)((const uint8_t *)SP - at);
}

/* Cycles of one step; 0 where the 16-bit counter ran over. */
static uint16_t timed_step(void)
{
    TIFR1 = 1 << TOV1;
    TCNT1 = 0;
    ffc_step(&controller, &sample);
    const uint16_t cycles = TCNT1;
    return TIFR1 & (1 << TOV1) ? 0 : cycles;
}
#else
static void begin(void) {}
static void end(void) {}
static void paint(void) {}
static uint16_t depth(void) { return 0; }

static uint16_t timed_step(void)
{
    ffc_step(&controller, &sample);
    return 0;
}
#endif

int main(void)
{
    begin();
#ifndef WITHOUT_CONTROLLER
    ffc_reset(&controller);
    paint();
    bool tared = false;
    for (uint16_t k = 0; k < STEPS; k++) {
        measure(k);
        if (k == STEPS / 2u)
            tared = false;
        if (!tared)
            tared = ffc_tare(&controller); /* as soon as it rests, in both halves */
        const uint16_t cycles = timed_step();
        if (k == STEPS / 2u)
            printf("stack %u state %u\n", depth(), (unsigned)sizeof controller); /* before printf deepens it */
        uint32_t bits;
        memcpy(&bits, &controller.position_command, sizeof bits);
        printf("step %u %u %u %08lx\n", k, cycles, (unsigned)controller.state, (unsigned long)bits);
    }
#else
    measure(0);
    printf("step %u %u %u %08lx\n", 0u, 0u, 0u, 0UL);
#endif
    end();
    return 0;
}
