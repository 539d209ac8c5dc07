#include "delegate/jobFinish.h"

#include <filesystem>
#include <system_error>

#include "core/clock.h"

namespace mbfeat {

namespace {

/// Removes an image that MBFeat wrote. Whatever else a productName points to is the user's.
void removeStale(const std::string& path) {
    std::error_code ignored; // a file that cannot be removed was reported by the failed writing
    if (!std::filesystem::is_regular_file(path, ignored)) {
        return;
    }
    const Result<AovLayout> layout = describeProductFile(path);
    if (layout && layout.value().isOwn()) {
        std::filesystem::remove(path, ignored);
    }
}

void addError(const Error& error, Diagnostics& diagnostics, RenderReport& report) {
    diagnostics.error(error.subject, error.text);
    report.errors.push_back(error.subject + ": " + error.text);
}

void writeProducts(const JobResult& result, Diagnostics& diagnostics, RenderReport& report) {
    for (const FinishedFrame::Image& image : result.images) {
        for (const ProductSpec& product : image.products) {
            std::vector<Error> problems = validateProduct(product);
            if (problems.empty()) {
                if (const Status status =
                        writeProduct(product, *image.film, report, &diagnostics)) {
                    problems.push_back(*status);
                }
            }
            if (problems.empty()) {
                report.written.push_back(product.path);
                continue;
            }
            removeStale(product.path);
            for (const Error& problem : problems) {
                addError(problem, diagnostics, report);
            }
        }
    }
}

} // namespace

void finishJob(const JobResult& result, Diagnostics& messages, RenderReport& report) {
    for (const Error& error : result.errors) {
        report.errors.push_back(error.subject + ": " + error.text);
    }
    for (const std::string& path : result.staleFiles) {
        removeStale(path);
    }
    const bool badData =
        messages.count(Severity::kWarning) > 0 || messages.count(Severity::kError) > 0;
    if (result.onError == OnError::kAbort && badData) {
        addError({"mbfeat:onError", "it is abort and there were warnings or errors; no product "
                                    "is written. Repair what they name, or set it to warn."},
                 messages, report);
    } else if (!report.interrupted) {
        const Clock::time_point begin = Clock::now();
        writeProducts(result, messages, report);
        report.seconds.emplace_back("write", secondsSince(begin));
    }
    report.warnings = messages.count(Severity::kWarning);
    auto frame = std::make_shared<FinishedFrame>();
    frame->images = result.images;
    frame->report = report;
    Host::instance().publish(std::move(frame));
}

} // namespace mbfeat
