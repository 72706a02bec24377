"""What goes beyond the core: order kept (15.2, 16.10), and of mode stream all kinds of cells but those given by faces
(16.2), mixed decisions (10.5, 16.6), mixed values (16.12), cells at gates (16.13), volumes in pieces (16.14)."""
from container import MORE
from more import gates, kinds, mixed, mixing, order, pieces

MORE |= {"an order that is kept": order.reorder, "another order than that of the file": order.reorder_stream}
MORE |= {"cells of all kinds": kinds.AllCells, "cells at gates": gates.Gates, "mixed decisions": mixing.MixedAsker}
MORE |= {"mixed values": mixed.MixedValues, "volumes in pieces": pieces.decode}
