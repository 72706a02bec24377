"""What goes beyond the core, and is added to it by name (container.beyond) when this is imported:
order    15.2, 16.10: an order that is kept
kinds    16.2, 16.6: of mode stream all kinds of cells but those given by faces
mixing   10.5, 16.6: decisions mixed from several cells (mode stream from effort 4 on)
mixed    16.12, and what it takes of 14.6 and 14.7: mixed values
gates    16.13: cells that come at gates
pieces   16.14: volumes in pieces"""
from container import MORE
from more import gates, kinds, mixed, mixing, order, pieces

MORE |= {"an order that is kept": order.reorder, "another order than that of the file": order.reorder_stream}
MORE |= {"cells of all kinds": kinds.AllCells, "cells at gates": gates.Gates, "mixed decisions": mixing.MixedAsker}
MORE |= {"mixed values": mixed.MixedValues, "volumes in pieces": pieces.decode}
