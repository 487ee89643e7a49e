#pragma once

#include "BlockFactory/Core/Block.h"
#include "BlockFactory/Core/FactorySingleton.h"
#include "host_information.hpp"
#include "log_capture.hpp"

#include <exception>
#include <memory>
#include <string>

namespace bf::boundary {

class LegacyClass {
  public:
    using Factory = blockfactory::core::ClassFactorySingleton::ClassFactory;

    /// Both throw PluginError.
    LegacyClass(const std::string& file, std::string library, std::string name);
    LegacyClass(std::shared_ptr<const Factory> factory, std::string library, std::string name);

    const std::string library, name;
    const Factory& factory() const { return *factory_; }
    /// "plugin 'P', block 'B', output: reason"
    std::string locate(const char* call, const std::string& reason) const;

  private:
    std::shared_ptr<const Factory> factory_;
};

/// An object of a plugin's class together with what its engine tells it. Nothing that the plugin does wrong
/// leaves a call.
class LegacyObject {
  public:
    LegacyObject(std::shared_ptr<const LegacyClass> legacy, const Arguments& arguments);
    ~LegacyObject();
    LegacyObject(const LegacyObject&) = delete;
    LegacyObject& operator=(const LegacyObject&) = delete;

    HostInformation information;
    bool is_running = false;
    /// Why the last call failed; lives as long as the object.
    const char (&message() const)[1024] { return message_; }

    /// Calls f(block, information). False when that is false or throws: then message() says where and why.
    /// What a successful call logged goes to the log's warnings, with its origin.
    template <class F> bool call(const char* what, F&& f) noexcept {
        bool good = false;
        try {
            std::string logged, thrown;
            {
                LogCapture log;
                try {
                    good = block_ && f(*block_, information);
                } catch (const std::exception& error) {
                    thrown = std::string("threw an exception: ") + error.what();
                } catch (...) {
                    thrown = "threw an exception of unknown type";
                }
                if (good && !log.is_used()) return true;
                logged = log.take();
            }
            explain(what, good, thrown, logged);
        } catch (...) { // no memory for a message
        }
        return good;
    }

  private:
    void fail(const char* what, const std::string& reason);
    void explain(const char* what, bool good, const std::string& thrown, const std::string& logged);

    std::shared_ptr<const LegacyClass> legacy_;
    blockfactory::core::Block* block_ = nullptr;
    char message_[1024] = "";
};

} // namespace bf::boundary
