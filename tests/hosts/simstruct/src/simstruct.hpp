// All that a block is to its host.
#pragma once

#include "simstruct/model.hpp"

#include <memory>
#include <string>
#include <vector>

struct SimStruct_tag {
    struct Port {
        std::vector<int_T> dims; // empty: not known yet
        DTypeId type = SS_DOUBLE;
        bool feedthrough = false, connected = false;
        std::vector<std::byte> own; // of outputs, and of inputs that nothing drives
        const void* signal = nullptr;
        int width() const;
    };
    struct Work {
        int width = 0;
        DTypeId type = SS_DOUBLE;
        std::string name;
        bool is_state = false;
        std::vector<std::byte> memory;
    };

    ~SimStruct_tag();

    std::string path, error, phase;
    bool has_error = false;
    bool is_source = false; // a signal from outside, no block
    std::vector<std::string> warnings, calls, forbidden;
    std::vector<mxArray*> parameters;
    std::vector<int> tunable;
    int wanted_parameters = 0;
    std::vector<Port> inputs, outputs;
    double sample_time = INHERITED_SAMPLE_TIME, offset = 0, time = 0, step_size = 0;
    bool is_major = true, was_started = false;
    std::vector<double> states, rates, zero_crossings;
    int wanted_states = 0, wanted_pointers = 0, wanted_crossings = 0, wanted_work = 0;
    std::vector<Work> work;
    std::vector<void*> pointers;
    std::vector<std::vector<simstruct::Setting>> settings;
    std::vector<std::pair<std::string, int>> pointer_names;

    /// A count of states or work: mdlSetWorkWidths may set what mdlInitializeSizes left open.
    void set_count(int& count, int number, const char* what);
    void forbid(const std::string& what) { forbidden.push_back(what + " in " + phase); }
};

namespace simstruct {
/// Bytes of an element of a built-in type.
int bytes_of(DTypeId type);
} // namespace simstruct
