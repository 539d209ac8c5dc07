#pragma once
#include "pxr/trace/trace.h" // IWYU pragma: export
