// librcl ends the program that loads it where RMW_IMPLEMENTATION asks for another middleware than it has.
// This library is initialised before all that is loaded with it (DF_1_INITFIRST) and hides the variable,
// until Ros2 gives it back.
#include "rmw_choice.hpp"

#include <cstdlib>
#include <cstring>

namespace bf::ros2 {

namespace {

char* choice = nullptr;

__attribute__((constructor)) void hide_rmw_choice() {
    const char* const asked = std::getenv(rmw_choice);
    if (asked == nullptr) return;
    choice = strdup(asked);
    unsetenv(rmw_choice);
}

} // namespace

void give_rmw_choice_back() {
    if (choice != nullptr) setenv(rmw_choice, choice, 1);
    free(choice);
    choice = nullptr;
}

} // namespace bf::ros2
