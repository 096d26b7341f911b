// What vice_plugin.hpp is made of: the table of vice_plugin.h, filled from a class. Nothing here is for a plugin's author.
#ifndef VICE_PLUGIN_EXPORT_HPP
#define VICE_PLUGIN_EXPORT_HPP

#include <cstring>
#include <new>
#include <utility>

#include "vice_plugin.hpp"

namespace vice {

// Hidden, or the loader would take the static variables of two plugins for one.
#if defined(__GNUC__)
#pragma GCC visibility push(hidden)
#endif
namespace detail {

inline const vice_host *&host() {
    static const vice_host *the_host = nullptr;
    return the_host;
}

inline vice_text text(std::string_view view) { return {view.data(), view.size()}; }

inline std::string string(vice_text t) { return t.length == 0 ? std::string() : std::string(t.data, t.length); }

inline void say(vice_message *message, std::string_view what) {
    if (message == nullptr) return;
    message->length = what.size();
    const std::size_t n = what.size() < message->capacity ? what.size() : message->capacity;
    if (n > 0 && message->data != nullptr) std::memcpy(message->data, what.data(), n);
}

// Calls f; what it throws becomes the error.
template <class F>
std::int32_t guard(vice_message *message, F &&f) noexcept {
    try {
        return f();
    } catch (const Error &e) {
        say(message, e.what());
        if (message != nullptr && e.hint_length() > 0) {
            message->hint_start = message->length - e.hint_length() - 1;
            message->hint_length = e.hint_length();
        }
        return e.code();
    } catch (const std::bad_alloc &) {
        say(message, "out of memory");
        return VICE_ERROR;
    } catch (const std::exception &e) {
        say(message, e.what());
        return VICE_EXCEPTION;
    } catch (...) {
        say(message, "something that is no std::exception was thrown");
        return VICE_EXCEPTION;
    }
}

// Memory that goes to the host until it is released.
struct Owner {
    virtual ~Owner() = default;
};

template <class T>
struct Holder final : Owner {
    explicit Holder(T v) : value(std::move(v)) {}
    T value;
};

template <class T>
Holder<T> *hold(T value) {
    return new Holder<T>(std::move(value));
}

// As void* so that release can go back the same way.
inline void *token(Owner *owner) { return owner; }

// A list, with what it lies in until it is released.
template <class List, class T>
void give(List *out, std::vector<T> values) {
    auto *held = hold(std::move(values));
    *out = {held->value.data(), held->value.size(), token(held)};
}

struct OpenDataset {
    std::unique_ptr<Dataset> dataset;
    std::string name;
    std::vector<CameraName> cameras;
    std::vector<StreamName> streams;
    std::vector<vice_camera_entry> camera_entries;
    std::vector<vice_stream_entry> stream_entries;

    void check_camera(std::size_t index) const {
        if (index >= cameras.size()) throw Error("there is no camera " + std::to_string(index));
    }
    void check_stream(std::size_t index) const {
        if (index >= streams.size()) throw Error("there is no pose stream " + std::to_string(index));
    }
};

inline OpenDataset &of(void *dataset) {
    if (dataset == nullptr) throw Error("the data set is null");
    return *static_cast<OpenDataset *>(dataset);
}

template <class FormatClass>
struct Export {
    static FormatClass &format() {
        static FormatClass *the_format = new FormatClass();
        return *the_format;
    }

    static std::int32_t probe(vice_text path, vice_probe *out, vice_message *message) noexcept {
        return guard(message, [&] {
            Probe answer = format().probe(string(path));
            out->answer = answer.answer;
            if (!answer.paths.empty()) {
                auto paths = std::make_unique<Holder<std::pair<Probe, std::vector<vice_text>>>>(
                    std::pair<Probe, std::vector<vice_text>>(std::move(answer), {}));
                for (const std::string &p : paths->value.first.paths) paths->value.second.push_back(text(p));
                out->paths = paths->value.second.data();
                out->count = paths->value.second.size();
                out->owner = token(paths.release());
            }
            return VICE_OK;
        });
    }

    static std::int32_t open(vice_text path, const vice_setting *settings, std::size_t count, void **out,
                             vice_message *message) noexcept {
        return guard(message, [&] {
            Settings given;
            for (std::size_t i = 0; i < count; ++i) given[string(settings[i].key)] = string(settings[i].value);
            auto opened = std::make_unique<OpenDataset>();
            opened->dataset = format().open(string(path), given);
            if (!opened->dataset) throw Error(string(path) + ": cannot be opened");
            opened->name = opened->dataset->name();
            opened->cameras = opened->dataset->cameras();
            opened->streams = opened->dataset->streams();
            for (const CameraName &c : opened->cameras)
                opened->camera_entries.push_back(
                    {text(c.name), c.has_depth ? std::uint64_t{VICE_CAMERA_HAS_DEPTH} : std::uint64_t{0}});
            for (const StreamName &s : opened->streams)
                opened->stream_entries.push_back(
                    {text(s.name), s.kind, 0});
            *out = opened.release();
            return VICE_OK;
        });
    }

    static void close(void *dataset) noexcept {
        guard(nullptr, [&] {
            delete static_cast<OpenDataset *>(dataset);
            return VICE_OK;
        });
    }

    static void release(void *owner) noexcept {
        guard(nullptr, [&] {
            delete static_cast<Owner *>(owner);
            return VICE_OK;
        });
    }

    static std::int32_t describe(void *dataset, vice_dataset_info *out, vice_message *message) noexcept {
        return guard(message, [&] {
            OpenDataset &d = of(dataset);
            out->name = text(d.name);
            out->cameras = d.camera_entries.data();
            out->camera_count = d.camera_entries.size();
            out->streams = d.stream_entries.data();
            out->stream_count = d.stream_entries.size();
            return VICE_OK;
        });
    }

    static std::int32_t camera(void *dataset, std::size_t index, vice_camera *out, vice_message *message) noexcept {
        return guard(message, [&] {
            OpenDataset &d = of(dataset);
            d.check_camera(index);
            *out = d.dataset->camera(index);
            return VICE_OK;
        });
    }

    static std::int32_t frames(void *dataset, std::size_t index, vice_stamps *out, vice_message *message) noexcept {
        return guard(message, [&] {
            OpenDataset &d = of(dataset);
            d.check_camera(index);
            give(out, d.dataset->frames_ns(index));
            return VICE_OK;
        });
    }

    static std::int32_t image(void *dataset, std::size_t camera, std::size_t frame, vice_image *out,
                              vice_message *message) noexcept {
        return guard(message, [&] {
            OpenDataset &d = of(dataset);
            d.check_camera(camera);
            Image image = d.dataset->image(camera, frame);
            if (image.pixels.empty()) return VICE_NONE;
            auto *held = hold(std::move(image));
            const Image &i = held->value;
            const std::uint32_t pixel_bytes = i.format == VICE_PIXELS_RGB8 ? 3 : 1;
            *out = {i.width_px,      i.height_px,     i.format,   i.width_px * pixel_bytes,
                    i.pixels.data(), i.pixels.size(), token(held)};
            return VICE_OK;
        });
    }

    static std::int32_t image_file(void *dataset, std::size_t camera, std::size_t frame, vice_image_file *out,
                                   vice_message *message) noexcept {
        return guard(message, [&] {
            OpenDataset &d = of(dataset);
            d.check_camera(camera);
            auto file = d.dataset->image_file(camera, frame);
            if (!file) return VICE_NONE;
            give(out, std::move(*file));
            return VICE_OK;
        });
    }

    static std::int32_t body_from_camera(void *dataset, std::size_t camera, std::int64_t stamp_ns, vice_rigid *out,
                                         vice_message *message) noexcept {
        return guard(message, [&] {
            OpenDataset &d = of(dataset);
            d.check_camera(camera);
            *out = d.dataset->body_from_camera(camera, stamp_ns);
            return VICE_OK;
        });
    }

    static std::int32_t trajectory(void *dataset, std::size_t index, vice_poses *out, vice_message *message) noexcept {
        return guard(message, [&] {
            OpenDataset &d = of(dataset);
            d.check_stream(index);
            give(out, d.dataset->trajectory(index));
            return VICE_OK;
        });
    }

    static std::int32_t relative_motions(void *dataset, std::size_t index, vice_motions *out,
                                         vice_message *message) noexcept {
        return guard(message, [&] {
            OpenDataset &d = of(dataset);
            d.check_stream(index);
            give(out, d.dataset->relative_motions(index));
            return VICE_OK;
        });
    }

    static std::int32_t imu(void *dataset, vice_imu_samples *out, vice_message *message) noexcept {
        return guard(message, [&] {
            give(out, of(dataset).dataset->imu());
            return VICE_OK;
        });
    }

    static std::int32_t inertial_state(void *dataset, std::int64_t stamp_ns, vice_inertial_state *out,
                                       vice_message *message) noexcept {
        return guard(message, [&] {
            const auto state = of(dataset).dataset->inertial_state(stamp_ns);
            if (!state) return VICE_NONE;
            *out = *state;
            return VICE_OK;
        });
    }

    static std::int32_t depth_image(void *dataset, std::size_t camera, std::size_t frame, vice_depth_image *out,
                                    vice_message *message) noexcept {
        return guard(message, [&] {
            OpenDataset &d = of(dataset);
            d.check_camera(camera);
            auto depth = d.dataset->depth_image(camera, frame);
            if (!depth) return VICE_NONE;
            auto *held = hold(std::move(*depth));
            const DepthImage &i = held->value;
            *out = {i.stamp_ns,      i.width_px, i.height_px, i.z_m.data(), i.z_m.size() * sizeof(float),
                    i.width_px * 4u, 0,          token(held)};
            return VICE_OK;
        });
    }

    static std::int32_t cloud(void *dataset, vice_cloud *out, vice_message *message) noexcept {
        return guard(message, [&] {
            auto cloud = of(dataset).dataset->cloud();
            if (!cloud) return VICE_NONE;
            auto *held = hold(std::move(*cloud));
            const Cloud &c = held->value;
            out->kind = c.ply_path.empty() ? VICE_CLOUD_POINTS : VICE_CLOUD_PLY;
            out->ply_path = text(c.ply_path);
            out->points = c.points.data();
            out->count = c.points.size();
            out->world_from_cloud = c.world_from_cloud;
            out->owner = token(held);
            return VICE_OK;
        });
    }

    static std::int32_t floor(void *dataset, std::int64_t keyframe_ns, vice_floor *out, vice_message *message) noexcept {
        return guard(message, [&] {
            const auto floor = of(dataset).dataset->floor(keyframe_ns);
            if (!floor) return VICE_NONE;
            *out = *floor;
            return VICE_OK;
        });
    }

    static std::int32_t facts(void *dataset, vice_facts *out, vice_message *message) noexcept {
        return guard(message, [&] {
            using Held = std::pair<std::vector<Fact>, std::vector<vice_fact>>;
            auto held = std::make_unique<Holder<Held>>(Held(of(dataset).dataset->facts(), {}));
            for (const Fact &f : held->value.first) held->value.second.push_back({text(f.section), text(f.text)});
            out->facts = held->value.second.data();
            out->count = held->value.second.size();
            out->owner = token(held.release());
            return VICE_OK;
        });
    }

    static std::int32_t suspicions(void *dataset, vice_suspicions *out, vice_message *message) noexcept {
        return guard(message, [&] {
            using Held = std::pair<std::vector<Suspicion>, std::vector<vice_suspicion>>;
            auto held = std::make_unique<Holder<Held>>(Held(of(dataset).dataset->suspicions(), {}));
            for (const Suspicion &s : held->value.first)
                held->value.second.push_back(
                    {text(s.code), text(s.about), text(s.message), text(s.evidence), text(s.advice), s.count});
            out->suspicions = held->value.second.data();
            out->count = held->value.second.size();
            out->owner = token(held.release());
            return VICE_OK;
        });
    }

    struct HeldFindings {
        std::vector<Finding> own;
        std::vector<std::vector<vice_number>> numbers;
        std::vector<vice_finding> findings;
    };

    static std::int32_t checks(void *dataset, vice_findings *out, vice_message *message) noexcept {
        return guard(message, [&] {
            auto held = std::make_unique<Holder<HeldFindings>>(HeldFindings{of(dataset).dataset->checks(), {}, {}});
            auto &value = held->value;
            for (const Finding &f : value.own) {
                value.numbers.emplace_back();
                for (const Number &n : f.numbers) value.numbers.back().push_back({text(n.name), n.value, text(n.unit)});
            }
            for (std::size_t i = 0; i < value.own.size(); ++i) {
                const Finding &f = value.own[i];
                value.findings.push_back({text(f.check), text(f.about), text(f.says), text(f.mend), value.numbers[i].data(),
                                          value.numbers[i].size(), f.state, 0});
            }
            out->findings = value.findings.data();
            out->count = value.findings.size();
            out->owner = token(held.release());
            return VICE_OK;
        });
    }

    // What the table points at.
    struct Texts {
        std::string name, version, description;
        std::vector<std::string> offers;
        std::vector<SettingInfo> settings;
        std::vector<vice_text> offer_texts;
        std::vector<vice_setting_info> setting_infos;
        vice_plugin_table table{};
    };

    static vice_plugin_table *make() {
        auto texts = std::make_unique<Texts>();
        FormatClass &f = format();
        texts->name = f.name();
        texts->version = f.version();
        texts->description = f.description();
        texts->offers = f.offers();
        texts->settings = f.settings();
        for (const std::string &o : texts->offers) texts->offer_texts.push_back(text(o));
        for (const SettingInfo &s : texts->settings)
            texts->setting_infos.push_back({text(s.key), text(s.description)});
        vice_plugin_table &t = texts->table;
        t.abi_version = VICE_ABI_VERSION;
        t.struct_size = sizeof(vice_plugin_table);
        t.flags = f.thread_safe() ? VICE_FLAG_THREAD_SAFE : 0;
        t.name = text(texts->name);
        t.version = text(texts->version);
        t.description = text(texts->description);
        t.offers = texts->offer_texts.data();
        t.offer_count = texts->offer_texts.size();
        t.settings = texts->setting_infos.data();
        t.setting_count = texts->setting_infos.size();
        t.probe = &probe;
        t.open = &open;
        t.close = &close;
        t.release = &release;
        t.describe = &describe;
        t.camera = &camera;
        t.frames = &frames;
        t.image = &image;
        t.body_from_camera = &body_from_camera;
        t.trajectory = &trajectory;
        t.relative_motions = &relative_motions;
        t.imu = &imu;
        t.inertial_state = &inertial_state;
        t.depth_image = &depth_image;
        t.cloud = &cloud;
        t.floor = &floor;
        t.facts = &facts;
        t.image_file = &image_file;
        t.suspicions = &suspicions;
        t.checks = &checks;
        // Lives as long as the library, which is never unloaded.
        return &texts.release()->table;
    }

    static const vice_plugin_table *table(const vice_host *given) noexcept {
        host() = given;
        try {
            static const vice_plugin_table *the_table = make();
            return the_table;
        } catch (const std::exception &e) {
            log(VICE_LOG_ERROR, e.what());
        } catch (...) {
            log(VICE_LOG_ERROR, "something that is no std::exception was thrown");
        }
        return nullptr;
    }
};

}  // namespace detail
#if defined(__GNUC__)
#pragma GCC visibility pop
#endif

inline void log(std::int32_t level, std::string_view line) {
    const vice_host *h = detail::host();
    if (h != nullptr && h->log != nullptr) h->log(h->context, level, detail::text(line));
}

}  // namespace vice

#endif
