#include "film/host.h"

#include <csignal>

#include <doctest/doctest.h>

using namespace mbfeat;

namespace {

volatile std::sig_atomic_t gEarlierHandlerCalls = 0;

void earlierHandler(int) {
    gEarlierHandlerCalls = gEarlierHandlerCalls + 1;
}

} // namespace

TEST_CASE("an interrupt asks for a stop, and the earlier handler comes back") {
    Host& host = Host::instance();
    host.clearStop();
    gEarlierHandlerCalls = 0;
    auto* const original = std::signal(SIGINT, earlierHandler);
    host.installInterruptHandler();
    host.installInterruptHandler(); // a second call must not save our own handler
    CHECK_FALSE(host.stopRequested());
    std::raise(SIGINT);
    CHECK(host.stopRequested());
    CHECK(gEarlierHandlerCalls == 0);
    host.restoreInterruptHandler();
    std::raise(SIGINT);
    CHECK(gEarlierHandlerCalls == 1);
    host.clearStop();
    CHECK_FALSE(host.stopRequested());
    std::signal(SIGINT, original);
}

TEST_CASE("a stop that the program asked for does not make the first interrupt deadly") {
    Host& host = Host::instance();
    host.installInterruptHandler();
    host.requestStop();
    std::raise(SIGINT); // were this the second, the process would end here
    CHECK(host.stopRequested());
    host.restoreInterruptHandler();
    host.clearStop();
}

TEST_CASE("the published frame lives until it is replaced and nobody holds it") {
    Host& host = Host::instance();
    auto frame = std::make_shared<FinishedFrame>();
    const std::weak_ptr<const FinishedFrame> watched = frame;
    host.publish(std::move(frame));
    std::shared_ptr<const FinishedFrame> held = host.lastFrame();
    CHECK(held == watched.lock());
    host.dropLastFrame();
    CHECK(host.lastFrame() == nullptr);
    CHECK_FALSE(watched.expired());
    held.reset();
    CHECK(watched.expired());
}

TEST_CASE("settings of the command line and the stage are handed on as given") {
    Host& host = Host::instance();
    host.setOverrides({{"mbfeat:seed", "1"}, {"mbfeat:seed", "2"}});
    CHECK(host.overrides().size() == 2);
    CHECK(host.overrides()[1].second == "2");
    host.setOverrides({});
    host.setStage("a.usda");
    CHECK(host.stage() == "a.usda");
    host.setStage("");
}

TEST_CASE("messages go to the handler while there is one") {
    Host& host = Host::instance();
    const Message message{Severity::kWarning, "/World/mesh", "it has no points"};
    CHECK_FALSE(host.deliver(message));
    std::vector<std::string> subjects;
    host.setMessageHandler([&](const Message& m) { subjects.push_back(m.subject); });
    CHECK(host.deliver(message));
    host.setMessageHandler(nullptr);
    CHECK_FALSE(host.deliver(message));
    CHECK(subjects == std::vector<std::string>{"/World/mesh"});
}

TEST_CASE("a message may be the consequence of another one") {
    Host& host = Host::instance();
    std::vector<std::string> subjects;
    host.setMessageHandler([&](const Message& m) {
        subjects.push_back(m.subject);
        if (m.subject == "first") {
            CHECK(host.deliver({Severity::kInfo, "second", ""}));
        }
    });
    CHECK(host.deliver({Severity::kInfo, "first", ""}));
    host.setMessageHandler(nullptr);
    CHECK(subjects == std::vector<std::string>{"first", "second"});
}
