#include "film/filmMemory.h"

#include <cstring>
#include <optional>

#include <doctest/doctest.h>

using namespace mbfeat;

TEST_CASE("while somebody uses films, a film of like size gets the memory of the last one") {
    std::optional<FilmMemoryUser> user;
    user.emplace();
    std::optional<FilmMemory> first;
    first.emplace(std::size_t{1} << 20U);
    void* const place = first->data();
    std::memset(place, 1, first->bytes());
    first.reset();
    {
        const FilmMemory same((std::size_t{1} << 20U) - 100);
        CHECK(same.data() == place);
        CHECK(same.bytes() == std::size_t{1} << 20U);
        FilmMemory beside(std::size_t{1} << 20U);
        CHECK(beside.data() != place);
        std::memset(beside.data(), 2, beside.bytes());
    }
    const FilmMemory small(1000);
    CHECK(small.bytes() == 1000);
    CHECK(small.data() != place);
}

TEST_CASE("no memory stays when the last user goes, and none is not an error") {
    {
        const FilmMemoryUser user;
        FilmMemory memory(std::size_t{1} << 20U);
        std::memset(memory.data(), 1, memory.bytes());
    }
    const FilmMemory none(0);
    CHECK(none.data() == nullptr);
    FilmMemory a(64);
    FilmMemory b(std::move(a));
    CHECK(b.bytes() == 64);
}
