// What worlds say of what they cannot be made from.
#pragma once

#include <exception>
#include <gtest/gtest.h>
#include <initializer_list>
#include <string>

namespace bf::physics {

/// Of an action that is refused; empty: it was done.
template <class Action> std::string complaint_of(const Action& action) {
    try {
        action();
        return {};
    } catch (const std::exception& error) {
        return error.what();
    }
}

inline void expect_contains(const std::string& text, std::initializer_list<const char*> parts) {
    for (const char* part : parts)
        EXPECT_NE(text.find(part), std::string::npos) << part << "\nis not in: " << text;
}

} // namespace bf::physics
