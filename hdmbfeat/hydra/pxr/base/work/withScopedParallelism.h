#pragma once
#include "pxr/work/withScopedParallelism.h" // IWYU pragma: export
