// The calls of zynq_pgs.h for C++17: a handle that closes itself, and exceptions with the status.
//
// A program copies this file and changes it as it likes.
#pragma once

#include <stdexcept>
#include <utility>
#include <vector>

#include <zynq_pgs.h>

namespace zpgs {

// A call that failed. docs/engines.md says for each status what to do.
class Error : public std::runtime_error {
public:
    Error(zpgs_status status, const char *text) : std::runtime_error(text), status_(status) {}
    zpgs_status status() const { return status_; }

private:
    zpgs_status status_;
};

inline zpgs_parameters default_parameters() {
    zpgs_parameters parameters;
    const zpgs_status status = zpgs_parameters_default(&parameters, sizeof parameters);
    if (status != ZPGS_STATUS_OK) throw Error(status, zpgs_last_error(nullptr));
    return parameters;
}

// An open accelerator. It can be moved, not copied.
class Accelerator {
public:
    explicit Accelerator(const char *board) {
        const zpgs_status status = zpgs_open(board, &handle_);
        if (status != ZPGS_STATUS_OK) throw Error(status, zpgs_last_error(nullptr));
    }
    Accelerator(Accelerator &&other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
    Accelerator &operator=(Accelerator &&other) noexcept {
        std::swap(handle_, other.handle_);
        return *this;
    }
    Accelerator(const Accelerator &) = delete;
    Accelerator &operator=(const Accelerator &) = delete;
    // Closing stops a step in flight.
    ~Accelerator() { zpgs_close(handle_); }

    void set_shapes(const std::vector<zpgs_shape> &shapes) {
        check(zpgs_set_shapes(handle_, shapes.data(), shapes.size()));
    }

    // Begins the list of a step's collisions. An exception in the narrow phase does no harm: the next
    // step begins another list.
    void begin() { check(zpgs_begin(handle_)); }
    void push(const zpgs_collision &collision) { check(zpgs_push(handle_, &collision, nullptr, 1)); }
    void push(const zpgs_collision &collision, const zpgs_impulses &impulses) {
        check(zpgs_push(handle_, &collision, &impulses, 1));
    }
    void end(const zpgs_bodies &bodies, const zpgs_parameters &parameters) {
        check(zpgs_end(handle_, &bodies, &parameters));
    }

    zpgs_report wait(const zpgs_bodies &bodies) {
        zpgs_report report{};
        report.size = sizeof report;
        check(zpgs_wait(handle_, &bodies, &report));
        return report;
    }

    // Stores the impulses of the last step. `impulses` has one element for each collision of that step.
    void read_impulses(std::vector<zpgs_impulses> &impulses) {
        const zpgs_strided array = {impulses.data(), sizeof(zpgs_impulses)};
        check(zpgs_read_impulses(handle_, array, impulses.size()));
    }

private:
    void check(zpgs_status status) const {
        if (status != ZPGS_STATUS_OK) throw Error(status, zpgs_last_error(handle_));
    }

    zpgs_accelerator *handle_ = nullptr;
};

}  // namespace zpgs
