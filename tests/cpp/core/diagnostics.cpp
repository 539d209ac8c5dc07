// Messages: each is forwarded once, by a handler that may do anything, and stands while its section
// says so.
#include <memory>
#include <string>
#include <vector>

#include <doctest/doctest.h>

#include "core/diagnostics.h"

using namespace mbfeat;

TEST_CASE("a message is forwarded once however often it is reported") {
    Diagnostics diagnostics;
    std::vector<std::string> heard;
    diagnostics.setHandler([&](const Message& m) { heard.push_back(m.subject + ": " + m.text); });
    diagnostics.warn("/a", "is bad");
    diagnostics.warn("/a", "is bad");
    diagnostics.warn("/b", "is bad");
    diagnostics.setHandler(nullptr);
    diagnostics.warn("/c", "is bad");
    CHECK(heard == std::vector<std::string>{"/a: is bad", "/b: is bad"});
    CHECK(diagnostics.messages().size() == 3);
}

TEST_CASE("a handler may report, count and replace itself") {
    Diagnostics diagnostics;
    std::vector<std::string> heard;
    diagnostics.setHandler([&](const Message& message) {
        heard.push_back(message.subject);
        CHECK(diagnostics.messages().size() == heard.size());
        if (message.subject == "/a") {
            diagnostics.error("/a/child", "was lost with it");
            diagnostics.setHandler(nullptr);
        }
    });
    diagnostics.warn("/a", "is bad");
    diagnostics.warn("/b", "is bad");
    CHECK(heard == std::vector<std::string>{"/a", "/a/child"});
}

TEST_CASE("a message counts once, until all sections that reported it took it back") {
    Diagnostics whole;
    int forwarded = 0;
    whole.setHandler([&](const Message& /*message*/) { ++forwarded; });
    auto first = std::make_unique<Diagnostics>(whole);
    Diagnostics second(whole);
    first->warn("/a", "is bad");
    first->warn("/a", "is bad");
    second.warn("/a", "is bad");
    second.error("/b", "is worse");
    CHECK(whole.count(Severity::kWarning) == 1);
    CHECK(whole.count(Severity::kError) == 1);
    second.withdraw();
    CHECK(whole.count(Severity::kWarning) == 1);
    CHECK(whole.count(Severity::kError) == 0);
    first.reset();
    CHECK(whole.count(Severity::kWarning) == 0);

    second.warn("/a", "is bad");
    CHECK(whole.count(Severity::kWarning) == 1);
    CHECK(second.count(Severity::kWarning) == 1);
    CHECK(forwarded == 2);
    CHECK(whole.messages().size() == 2);

    whole.clear();
    CHECK(whole.messages().empty());
    CHECK(whole.count(Severity::kWarning) == 1); // of the second section
    whole.warn("/a", "is bad");
    CHECK(forwarded == 3);
}

TEST_CASE("a section may outlive the whole") {
    auto whole = std::make_unique<Diagnostics>();
    Diagnostics section(*whole);
    section.warn("/a", "is bad");
    whole.reset();
    section.warn("/b", "is bad");
    CHECK(section.count(Severity::kWarning) == 2);
}
