// The run that counts, in a shared library.
#include "../counting_run.hpp"

extern "C" const bf_run_library* bf_run_v1() {
    static bf_run_model model; // the only one that it makes
    static const bf_run_library library = [] {
        bf_run_library all = bf::test::counting_run();
        all.create = [] { return model.has_memory ? &model : nullptr; };
        return all;
    }();
    return &library;
}
