// Floating-point traps that are reported instead of ending the process.
#pragma once

#include <string>
#include <vector>

namespace mbfeat::stability {

/// False in release builds, whose compiler is told that nothing traps.
bool trapsAreSupported();

/// Installs the handler; to be called once before any switchTraps().
void installTrapHandler();

/// Switches traps on invalid operations, divisions by zero and overflows on or off, for the calling
/// thread and for threads that it starts from then on.
void switchTraps(bool on);
bool trapsAreOn();

/// What fired since the last call, by place: "division by zero in mbfeat::f() (libmbfeat.so+0x12)".
/// A thread reports its first trap in a stretch of code and then runs on with traps masked, up to
/// the next switchTraps() or the end of masked code.
std::vector<std::string> takeTraps();

} // namespace mbfeat::stability
