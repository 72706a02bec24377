#pragma once

#include <maille/geometry.h>
