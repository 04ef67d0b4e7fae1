/* Feeds a controller from standard input, for the tests: one request in, one answer out, both binary. */
#include <stdio.h>
#include <string.h>

#include "ffc.h"

typedef struct {
    uint32_t request; /* 0: step; 1: recover, then step; 2: reset, then step; 3: tare, then step */
    uint32_t has_time;
    uint32_t has_temperature;
    uint32_t time_us;
    uint32_t button_up;
    float numbers[7]; /* position, velocity, current, payload, two tilts, temperature */
} request;

typedef struct {
    uint32_t state;
    uint32_t fault;
    uint32_t limited;
    uint32_t command_valid;
    uint32_t ready;
    uint32_t taring; /* the tare that was asked for began */
    uint32_t disturbed;
    uint32_t held;
    /* returned, position_command, external_torque, velocity_wanted, what is compensated, the uncertainty and what
       was learned */
    float numbers[11];
} answer;

int main(void)
{
    static ffc_controller controller;
    ffc_reset(&controller);
    request in;
    while (fread(&in, sizeof in, 1, stdin) == 1) {
        if (in.request == 1)
            ffc_recover(&controller);
        if (in.request == 2)
            ffc_reset(&controller);
        const bool taring = in.request == 3 && ffc_tare(&controller);
        const ffc_sample sample = {
            .position = in.numbers[0],
            .velocity = in.numbers[1],
            .current = in.numbers[2],
            .payload = in.numbers[3],
            .tilt_alpha = in.numbers[4],
            .tilt_beta = in.numbers[5],
            .temperature = in.numbers[6],
            .time_us = in.time_us,
            .has_temperature = in.has_temperature != 0,
            .button_up = in.button_up != 0,
            .has_time = in.has_time != 0,
        };
        const float returned = ffc_step(&controller, &sample);
        const answer out = {
            (uint32_t)controller.state,
            (uint32_t)controller.fault,
            controller.limited,
            controller.command_valid,
            ffc_ready(&controller),
            taring,
#if FFC_LIGHT
            controller.tare_outcome != FFC_TARE_USED,
#else
            false,
#endif
            controller.is_up || controller.arresting,
            {
                returned,
                controller.position_command,
                controller.external_torque,
                controller.velocity_wanted,
                controller.gravity,
                controller.friction,
                controller.effects,
#if FFC_LIGHT
                controller.uncertainty,
                controller.learned[0] + controller.load_offset,
                1.0f + controller.learned[1],
                1.0f + controller.learned[2],
#else
                0.0f, 0.0f, 1.0f, 1.0f,
#endif
            },
        };
        if (fwrite(&out, sizeof out, 1, stdout) != 1)
            return 1;
    }
    return 0;
}
