/* The sketch as a library on this machine: SKETCH is its file. */
#include <string.h>

#include SKETCH

static uint32_t now_us;
static uint8_t pins[20];
static uint8_t waiting[256];
static size_t from, to;
static size_t (*bus)(uint32_t now_us, const uint8_t *sent, size_t count, uint8_t *answer);

HardwareSerial Serial;

void pinMode(uint8_t pin, uint8_t mode) { pins[pin] = mode == INPUT_PULLUP ? HIGH : LOW; }
void digitalWrite(uint8_t pin, uint8_t value) { pins[pin] = value; }
int digitalRead(uint8_t pin) { return pins[pin]; }
unsigned long micros() { return now_us += 4; } /* as much as the Uno's clock counts by */
unsigned long millis() { return now_us / 1000; }
void delay(unsigned long ms) { now_us += 1000 * ms; }

void HardwareSerial::begin(unsigned long) {}
int HardwareSerial::available() { return (int)(to - from); }
int HardwareSerial::read() { return from < to ? waiting[from++] : -1; }
size_t HardwareSerial::write(const uint8_t *bytes, size_t count)
{
    from = to = 0;
    now_us += 10 * (uint32_t)count;
    to = bus(now_us, bytes, count, waiting);
    return count;
}
void HardwareSerial::flush() {}

extern "C" {
void board_begin(size_t (*its_bus)(uint32_t, const uint8_t *, size_t, uint8_t *))
{
    bus = its_bus;
    setup();
}
/* Up to that time; returns the state of the controller. */
int board_run(uint32_t until_us)
{
    while ((int32_t)(now_us - until_us) < 0)
        loop();
    return axis.state;
}
uint32_t board_now() { return now_us; }
void board_button(bool down) { pins[BUTTON_PIN] = down ? LOW : HIGH; }
#ifdef FFC_PATH_H
void board_play(bool down) { pins[PLAY_PIN] = down ? LOW : HIGH; }
int board_path_state() { return playing ? (int)player.state : -1; }
#endif
bool board_led() { return pins[LED_BUILTIN] == HIGH; }
bool board_bus_fault() { return bus_fault; }
bool board_read(uint16_t address, uint8_t *data, uint8_t count) { return servo_read(SERVO, address, data, count); }
bool board_write(uint16_t address, uint32_t value, uint8_t size) { return servo_write(SERVO, address, value, size); }
uint8_t board_error() { return servo_error; }
}
