/* What the sketch uses of the Arduino core; `board.cpp` has it on this machine, where a clock is a number and
   the bus is a function of the test. */
#pragma once
#include <math.h>
#include <stddef.h>
#include <stdint.h>

enum { LOW, HIGH, OUTPUT, INPUT_PULLUP, LED_BUILTIN = 13 };

void pinMode(uint8_t pin, uint8_t mode);
void digitalWrite(uint8_t pin, uint8_t value);
int digitalRead(uint8_t pin);
unsigned long micros();
unsigned long millis();
void delay(unsigned long ms);

struct HardwareSerial {
    void begin(unsigned long baud);
    int available();
    int read();
    size_t write(const uint8_t *bytes, size_t count);
    void flush();
};
extern HardwareSerial Serial;
