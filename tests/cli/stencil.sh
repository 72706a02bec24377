# Weights by name, and what is wrong with a name.
maille stencil | head -4
maille stencil butterfly
maille stencil k-star:6 --noise 1
maille stencil 'grid:###/##x' --rule spectral | tail -2
try maille stencil buterfly
try maille stencil butterfly --rule spectral
try maille stencil k-star:17
try maille stencil butterfly --order 25
