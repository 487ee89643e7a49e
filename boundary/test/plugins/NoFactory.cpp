// Uses the API but forgets to export its class; the function is only called like one.
#include "LegacyPlugin.hpp"

extern "C" int Matrices(int x) { return x; }
blockfactory::core::Block* unused() { return new legacy_test::Matrices; }
