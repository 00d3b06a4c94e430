// Captures the messages that urdfdom prints.
#pragma once

#include <console_bridge/console.h>

#include <string>

namespace counterpoint {

/// Collects urdfdom's error messages while it exists, then restores the previous output handler.
class CapturedMessages : public console_bridge::OutputHandler {
 public:
  CapturedMessages() : level_(console_bridge::getLogLevel()) {
    console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_WARN);
    console_bridge::useOutputHandler(this);
  }
  ~CapturedMessages() override {
    console_bridge::restorePreviousOutputHandler();
    console_bridge::setLogLevel(level_);
  }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level < console_bridge::CONSOLE_BRIDGE_LOG_ERROR) return;
    if (!errors_.empty()) errors_ += "; ";
    errors_ += text;
  }
  const std::string& errors() const { return errors_; }

 private:
  console_bridge::LogLevel level_;
  std::string errors_;
};

}  // namespace counterpoint
