#include "trapHandler.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>

#include <cxxabi.h>
#include <dlfcn.h>
#include <ucontext.h>
#include <xmmintrin.h>

#include "core/floatTraps.h"

namespace mbfeat::stability {

namespace {

constexpr unsigned kTrapping = _MM_MASK_INVALID | _MM_MASK_DIV_ZERO | _MM_MASK_OVERFLOW;

struct Trap {
    std::uintptr_t address = 0;
    int code = 0;
};

std::array<Trap, 256> traps;
std::atomic<std::size_t> trapCount{0};
thread_local bool on = false;

/// Notes the place and lets the instruction run again with all exceptions masked. Calls nothing
/// that a signal handler may not.
void handle(int /*signal*/, siginfo_t* info, void* context) {
    auto* const machine = static_cast<ucontext_t*>(context);
    const std::size_t i = trapCount.fetch_add(1);
    if (i < traps.size()) {
        traps[i] = {reinterpret_cast<std::uintptr_t>(info->si_addr), info->si_code};
    }
    machine->uc_mcontext.fpregs->mxcsr |= _MM_MASK_MASK;
}

const char* kindOf(int code) {
    switch (code) {
    case FPE_FLTDIV:
        return "division by zero";
    case FPE_FLTOVF:
        return "overflow";
    case FPE_FLTINV:
        return "invalid operation";
    default:
        return "floating-point exception";
    }
}

std::string describe(const Trap& trap) {
    std::string text = std::string(kindOf(trap.code)) + " in ";
    Dl_info where{};
    if (dladdr(reinterpret_cast<void*>(trap.address), &where) == 0 || where.dli_fname == nullptr) {
        return text + "unknown code";
    }
    if (where.dli_sname != nullptr) {
        int status = 0;
        const std::unique_ptr<char, void (*)(void*)> name(
            abi::__cxa_demangle(where.dli_sname, nullptr, nullptr, &status), std::free);
        text += status == 0 ? name.get() : where.dli_sname;
    } else {
        text += "a function without a name";
    }
    const std::string file(where.dli_fname);
    char offset[32];
    std::snprintf(offset, sizeof offset, "+0x%llx",
                  static_cast<unsigned long long>(
                      trap.address - reinterpret_cast<std::uintptr_t>(where.dli_fbase)));
    return text + " (" + file.substr(file.rfind('/') + 1) + offset + ")";
}

} // namespace

bool trapsAreSupported() {
    return MBFEAT_HAS_FLOAT_TRAPS != 0;
}

void installTrapHandler() {
    struct sigaction action {};
    action.sa_sigaction = handle;
    action.sa_flags = SA_SIGINFO;
    sigaction(SIGFPE, &action, nullptr);
}

void switchTraps(bool wanted) {
    on = wanted;
    _mm_setcsr((_mm_getcsr() & ~static_cast<unsigned>(_MM_EXCEPT_MASK)) | _MM_MASK_MASK);
    if (wanted) {
        _mm_setcsr(_mm_getcsr() & ~kTrapping);
    }
}

bool trapsAreOn() {
    return on;
}

std::vector<std::string> takeTraps() {
    std::vector<std::string> texts;
    const std::size_t count = std::min(trapCount.exchange(0), traps.size());
    for (std::size_t i = 0; i < count; ++i) {
        const std::string text = describe(traps[i]);
        if (std::find(texts.begin(), texts.end(), text) == texts.end()) {
            texts.push_back(text);
        }
    }
    return texts;
}

} // namespace mbfeat::stability
