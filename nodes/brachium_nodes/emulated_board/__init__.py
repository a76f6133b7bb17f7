"""The board that a firmware runs on here: its chips as their registers show them, its cell, its serial line.

It is a process of its own, so that the chip's memory holds the firmware and nothing else; it needs no other
package.
"""
