// Charts lowered to the table that kernels::chart::Step works on.
#pragma once

#include "bf/charts/chart.hpp"

#include <string>
#include <vector>

namespace bf::charts {

/// A formula reads an input, or one of its elements.
struct Reads {
    bool whole = false; ///< as a number
    int element = 0;    ///< the highest that is read, from 1
};

/// A port of a variable, or one that is true while a state is active.
struct NamedOutput {
    std::string port;
    bool is_state = false;
    int place = 0; ///< among the variables or the states, from 0
};

struct Table {
    std::vector<double> numbers;      ///< see kernels/chart_table.h
    std::vector<std::string> states;  ///< names, by number from 1: short where that is unambiguous
    std::vector<std::string> regions; ///< the first is the chart itself, `main`
    std::vector<std::string> ports;   ///< inputs, then events
    std::vector<Reads> reads;         ///< of each port
    std::vector<NamedOutput> outputs = {};
    int compounds = 0; ///< states with one active child
    int memory = 0;    ///< numbers that kernels::chart::Step keeps
};

/// Junctions become one transition for each way through them. Throws Refused with everything that is wrong.
Table lower(const Chart& chart);

/// The table of states without hierarchy: rows [from to condition minimum_time], states and conditions from
/// 1, column by column; the first condition is the first element of the only input.
Table lower_flat(const std::vector<std::string>& states, const std::vector<double>& rows);

/// A name of an event as a port: without dots.
std::string port_name(const std::string& event);

} // namespace bf::charts
