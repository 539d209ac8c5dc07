#pragma once
#include "pxr/work/dispatcher.h" // IWYU pragma: export
