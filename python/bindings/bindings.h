// The parts of the Python module mbfeat._core, and what they share.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include <nanobind/nanobind.h>

#include "core/diagnostics.h"
#include "film/film.h"
#include "film/report.h"

namespace mbfeat {

/// An Error of the library on its way to Python, where it is mbfeat._core.Error. It never leaves
/// the extension module.
class BindingError : public std::runtime_error {
public:
    explicit BindingError(const Error& error)
        : std::runtime_error(error.subject.empty() ? error.text
                                                   : error.subject + ": " + error.text) {}
};

/// Throws the error, if there is one.
inline void check(const Status& status) {
    if (status) {
        throw BindingError(*status);
    }
}

/// The value, or the error thrown.
template <class T>
T unwrap(Result<T> result) {
    if (!result) {
        throw BindingError(result.error());
    }
    return std::move(result.value());
}

/// A film as Python holds it. Arrays that refer to its memory hold another reference.
struct FilmHandle {
    std::shared_ptr<const Film> film;
};

/// A film that Python made and adds samples to.
struct OwnFilm : FilmHandle {
    std::shared_ptr<Film> writable;
};

void bindSettings(nanobind::module_& module);
void bindAovs(nanobind::module_& module);
void bindFilm(nanobind::module_& module);
void bindProducts(nanobind::module_& module);
void bindHost(nanobind::module_& module);
void bindColor(nanobind::module_& module);
void bindDenoise(nanobind::module_& module);

} // namespace mbfeat
