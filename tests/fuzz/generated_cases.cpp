// Models of chance that code is generated from: BF_FUZZ_COUNT of them (24) from seed BF_FUZZ_FIRST (0) on.
#include "compare.hpp"

#include "bf/formats/yaml.hpp"
#include "right_model.hpp"

#include <cstdlib>

namespace bf::codegen::test {

namespace {

std::uint64_t number(const char* name, std::uint64_t otherwise) {
    const char* const text = std::getenv(name);
    return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

std::vector<Case> chance_cases() {
    std::vector<Case> cases;
    const std::uint64_t first = number("BF_FUZZ_FIRST", 0), count = number("BF_FUZZ_COUNT", 24);
    for (std::uint64_t seed = first; seed < first + count; ++seed) {
        fuzz::Chance chance(seed);
        const std::string text = fuzz::right_model(chance, "chance_" + std::to_string(seed), true);
        try {
            Case one{Elaborated(formats::read_yaml_text(text, "chance.yaml")), 14};
            generate(one.elaborated.diagram);
            cases.push_back(std::move(one));
        } catch (const std::exception&) { // a model that elaboration or the generator refuses
        }
    }
    return cases;
}

} // namespace

std::vector<std::vector<Case> (*)()> families() { return {chance_cases}; }

} // namespace bf::codegen::test
