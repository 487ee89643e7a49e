// Runs a generated model on the inputs of NAME.in, if there is such a file; writes rows of its recorded
// signals and states to NAME.out, and why it failed to NAME.txt.
#pragma once

#include "bf/codegen/quantity.hpp"

#include <cstdio>
#include <memory>
#include <string>
#include <type_traits>

/// The files of a run. Out of line, since hundreds of models use them.
class CaseFiles {
  public:
    [[gnu::noinline]] explicit CaseFiles(const std::string& name)
        : in_(std::fopen((name + ".in").c_str(), "rb")) {
        if (!in_) return;
        out_ = std::fopen((name + ".out").c_str(), "wb");
        text_ = std::fopen((name + ".txt").c_str(), "wb");
    }
    [[gnu::noinline]] ~CaseFiles() {
        for (std::FILE* file : {in_, out_, text_})
            if (file) std::fclose(file);
    }
    bool have_inputs() const { return in_ != nullptr; }
    [[gnu::noinline]] void read(const bf::generated::Quantity& q, void* data) {
        if (q.where != bf::generated::Where::inputs) return;
        for (int i = 0; i < q.size(); ++i) {
            double x = 0;
            if (std::fread(&x, sizeof x, 1, in_) != 1) x = 0;
            bf::generated::write(data, q.type, i, x);
        }
    }
    [[gnu::noinline]] void write(double x) { std::fwrite(&x, sizeof x, 1, out_); }
    [[gnu::noinline]] void write(const bf::generated::Quantity& q, const void* data) {
        for (int i = 0; i < q.size(); ++i) write(bf::generated::read(data, q.type, i));
    }
    [[gnu::noinline]] void fail(const char* block, const char* why) {
        std::fprintf(text_, "%s: %s", block, why);
    }

  private:
    std::FILE *in_, *out_ = nullptr, *text_ = nullptr;
};

template <class Model, class = void> struct HasEvents : std::false_type {};
template <class Model>
struct HasEvents<Model, std::void_t<decltype(Model::before_event)>> : std::true_type {};

template <class Model> void run(const char* name, int steps) {
    CaseFiles files(name);
    if (!files.have_inputs()) return;
    const auto model = std::make_unique<Model>();
    auto record = [&] {
        files.write(model->time());
        for (const auto& q : Model::recorded_table()) files.write(q, model->data(q));
    };
    if constexpr (HasEvents<Model>::value) {
        model->observer = &record;
        model->before_event = [](void* f) { (*static_cast<decltype(record)*>(f))(); };
    }
    bool good = model->initialize();
    for (int k = 0; good && k < steps; ++k) {
        for (const auto& q : Model::recorded_table()) files.read(q, model->data(q));
        good = model->output();
        if (!good) break;
        record();
        good = model->update();
    }
    model->terminate();
    if (!good) files.fail(model->failed_block(), model->failure());
}
