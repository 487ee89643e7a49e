// Runs a model class that Simulink Coder generated.
#ifndef BLOCKFACTORY_CODER_GENERATEDCODEWRAPPER_H
#define BLOCKFACTORY_CODER_GENERATEDCODEWRAPPER_H

#ifndef MODEL
#error "Define MODEL as the name of the generated model; target_from_generated_code() of CMake does it."
#endif

#include <BlockFactory/SimulinkCoder/CoderBlockInformation.h>

#include <memory>
#include <string>

namespace blockfactory {
namespace coder {
template <typename T> class GeneratedCodeWrapper;
} // namespace coder
} // namespace blockfactory

/// T: the generated class, with initialize(), step(), terminate() and getRTM(). Each call is false when there
/// is no model or it reports an error, which getErrors() then gives.
template <typename T> class blockfactory::coder::GeneratedCodeWrapper {
  public:
    explicit GeneratedCodeWrapper(const std::string& modelName = {}, const unsigned& numSampleTimes = 0)
        : m_modelName(modelName), m_numSampleTimes(numSampleTimes) {}

    /// A new model; one that ran before is dropped.
    bool initialize() {
        m_model.reset(new T());
        m_parameters.clear();
        ModelParameters* const outer = CoderBlockInformation::collect(&m_parameters);
        m_model->initialize();
        CoderBlockInformation::collect(outer);
        return isGood();
    }
    /// Refused after a failure: some blocks of the model did not run.
    bool step() {
        if (!isGood()) return false;
        m_model->step();
        return isGood();
    }
    bool terminate() {
        if (!m_model) return false;
        m_model->terminate();
        return isGood();
    }
    std::string getErrors() const {
        if (!m_model) return "The model was not initialised.";
        if (!m_model->getRTM()) return "The model has no run-time data.";
        const char* status = m_model->getRTM()->errorStatus;
        return status ? status : "";
    }

    /// What the model gave its plugins' blocks: parameters().at("model/block").getParameter("name", value).
    const ModelParameters& parameters() const { return m_parameters; }

    const std::string& modelName() const { return m_modelName; }
    unsigned numSampleTimes() const { return m_numSampleTimes; }
    /// The generated object, for its root ports (M_U, M_Y); null before initialize.
    T* model() { return m_model.get(); }
    const T* model() const { return m_model.get(); }

  private:
    bool isGood() const { return m_model && m_model->getRTM() && !m_model->getRTM()->errorStatus; }

    std::unique_ptr<T> m_model;
    ModelParameters m_parameters;
    std::string m_modelName;
    unsigned m_numSampleTimes;
};

#endif
