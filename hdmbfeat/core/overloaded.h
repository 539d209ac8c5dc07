// A callable for std::visit out of lambdas.
#pragma once

namespace mbfeat {

template <class... Ts>
struct Overloaded : Ts... {
    using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;

} // namespace mbfeat
