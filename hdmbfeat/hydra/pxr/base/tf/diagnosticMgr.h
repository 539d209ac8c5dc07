#pragma once
#include "pxr/tf/diagnosticMgr.h" // IWYU pragma: export
