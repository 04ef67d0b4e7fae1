/* What the example sketch uses of the Arduino core and of DynamixelShield, declared for a syntax check. */
#pragma once
#include <math.h>
#include <stdint.h>

enum { LOW, HIGH, OUTPUT, INPUT_PULLUP, LED_BUILTIN = 13 };
enum { OP_EXTENDED_POSITION = 4 };

void pinMode(uint8_t pin, uint8_t mode);
void digitalWrite(uint8_t pin, uint8_t value);
int digitalRead(uint8_t pin);
unsigned long micros();
unsigned long millis();

struct DynamixelShield {
    void begin(unsigned long baud);
    bool setPortProtocolVersion(float version);
    bool torqueOn(uint8_t id);
    bool torqueOff(uint8_t id);
    bool setOperatingMode(uint8_t id, uint8_t mode);
    int32_t read(uint8_t id, uint16_t address, uint16_t length, uint8_t *buffer, uint16_t capacity,
                 uint32_t timeout_ms = 10);
    bool write(uint8_t id, uint16_t address, const uint8_t *data, uint16_t length, uint32_t timeout_ms = 10);
};
