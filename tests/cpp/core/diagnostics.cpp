// Messages: each is forwarded once, by a handler that may do anything.
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
