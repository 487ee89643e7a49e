// Runs a generated model on the inputs of NAME.in, if there is such a file; writes rows of its recorded
// signals and states to NAME.out, and why it failed to NAME.txt.
#pragma once

#include "bf/codegen/quantity.hpp"

#include <fstream>
#include <memory>
#include <string>

template <class Model> void run(const std::string& name, int steps) {
    using namespace bf::generated;
    std::ifstream in(name + ".in", std::ios::binary);
    if (!in) return;
    const auto model = std::make_unique<Model>();
    std::ofstream out(name + ".out", std::ios::binary), text(name + ".txt");
    const auto put = [&](double x) { out.write(reinterpret_cast<const char*>(&x), sizeof x); };
    bool good = model->initialize();
    for (int k = 0; good && k < steps; ++k) {
        for (const Quantity& q : Model::recorded_table())
            if (q.where == Where::inputs)
                for (int i = 0; i < q.size(); ++i) {
                    double x = 0;
                    in.read(reinterpret_cast<char*>(&x), sizeof x);
                    write(model->data(q), q.type, i, x);
                }
        good = model->output();
        if (!good) break;
        put(model->time());
        for (const Quantity& q : Model::recorded_table())
            for (int i = 0; i < q.size(); ++i) put(read(model->data(q), q.type, i));
        good = model->update();
    }
    model->terminate();
    if (!good) text << model->failed_block() << ": " << model->failure();
}
