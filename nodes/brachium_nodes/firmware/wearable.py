"""The node that brachium.json describes, on an ESP8266 or ESP32."""

import gc
import sys
import time

import configuration
import machine
from batches import Batches

TRY_SENSOR_MS = 1000
ASKED = configuration.ASKED

why = configuration.why_not()
if why:
    import setting_up

    setting_up.run(why)

# Memory in large pieces is taken while there is some; what has done its work is given back.
about = configuration.load()
del sys.modules["configuration"], configuration
batches = Batches(about["batch"], max(1, int(about["queue_s"] * about["rate_hz"] / about["batch"])))
gc.collect()
gc.threshold(512)  # little garbage at a time: what is free stays in one piece

import asyncio

from battery import Battery
from device_clock import DeviceClock, SampleClock
from node import Node
from radio import Radio
from sensor import Sensor
from serial_line import SerialLine


def start():
    """Run the node until its battery is empty, or somebody types Ctrl-C or `setup` on its serial line."""
    machine.freq(160_000_000)  # an ESP8266 starts with half of it
    pins, wired, wifi = about.pop("i2c"), about.pop("battery"), about.pop("wifi")
    scl, sda = machine.Pin(pins["scl"]), machine.Pin(pins["sda"])
    if pins["id"] < 0:
        bus = machine.SoftI2C(scl=scl, sda=sda, freq=pins["hz"])
    else:
        bus = machine.I2C(pins["id"], scl=scl, sda=sda, freq=pins["hz"])
    clock = DeviceClock()
    sensor = Sensor(bus, about["rate_hz"], SampleClock, batches)
    feed = machine.WDT().feed if about["watchdog"] else lambda: None
    while True:
        try:
            sensor.start(clock.now)
            break
        except OSError as error:
            print("sensor:", error)
            feed()
            time.sleep_ms(TRY_SENSOR_MS)
    battery = Battery(machine.ADC(wired["pin"]) if wired["pin"] >= 0 else None, wired)
    radio, line = Radio(wifi["name"], wifi["password"]), SerialLine()
    node = Node(about, sensor, batches, clock, battery, radio, feed, lambda: line.line() == "setup")
    try:
        asyncio.run(node.run())
    except KeyboardInterrupt:
        asyncio.new_event_loop()  # forgets the tasks of the old one
        asyncio.run(node.leave())
        return
    if node.asked:
        open(ASKED, "w").close()
        machine.reset()
    print("the battery is empty")
    machine.deepsleep()
