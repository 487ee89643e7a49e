// Edits a model file: edit MODEL.yaml. Prints the new text.
#include "bf/formats/yaml.hpp"
#include "bf/model/operation.hpp"

#include <iostream>

int main(int, char** arguments) {
    using namespace bf::model;
    namespace op = bf::model::operations;
    try {
        Model model = bf::formats::read_yaml(arguments[1]);
        History history;
        history.edit(model, op::Rename{"load", "brake"});
        history.edit(model, op::Set{"controller.proportional", "K", "2*Gain.Kp"});
        history.edit(model, op::Group{"controller", {"proportional", "integral", "sum"}, "pi"});
        history.undo(model); // no group after all
        history.edit(model,
                     operation_from_json(R"({"do": "move", "path": "motor", "to": {"x": 240, "y": 40}})"));
        std::cout << bf::formats::write_yaml(model);

        const Model before = model;
        const op::Patch back = edit(model, op::Remove{"motor"});
        std::cerr << to_json(back) << "\n";
        edit(model, back);
        return model == before ? 0 : 1;
    } catch (const Errors& errors) {
        std::cerr << errors.what() << "\n"; // each with file, line, path and remedy; the model is as it was
        return 1;
    }
}
