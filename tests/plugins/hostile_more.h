/* The calls of hostile.c that not every plugin has. */

static int32_t relative_motions(void *dataset, size_t index, vice_motions *out, vice_message *message) {
    static vice_motion motions[2];
    size_t i;
    (void)dataset;
    if (index != 1) return fail(message, "there is no such stream");
    for (i = 0; i < 2; ++i) {
        motions[i].from_ns = stamp(i);
        motions[i].to_ns = stamp(i + 1);
        motions[i].later_from_earlier.rotation_wxyz[0] = 1;
    }
#if defined(BROKEN_MOTIONS)
    motions[1].from_ns += 1;
#endif
    out->motions = motions;
    out->count = 2;
    return VICE_OK;
}

static int32_t imu(void *dataset, vice_imu_samples *out, vice_message *message) {
    static vice_imu_sample samples[3];
    size_t i;
    (void)dataset;
    (void)message;
    for (i = 0; i < 3; ++i) {
        samples[i].stamp_ns = stamp(i);
        samples[i].accel_body_m_s2[2] = 9.81;
    }
#if defined(NAN_IMU)
    samples[1].gyro_body_rad_s[2] = NAN;
#endif
    out->samples = samples;
    out->count = 3;
    return VICE_OK;
}

static int32_t inertial_state(void *dataset, int64_t at, vice_inertial_state *out, vice_message *message) {
    (void)dataset;
    (void)message;
    out->stamp_ns = at;
    out->world_from_body.rotation_wxyz[0] = 1;
#if defined(NAN_STATE)
    out->velocity_world_m_s[1] = INFINITY;
#endif
    return VICE_OK;
}

static int32_t depth_image(void *dataset, size_t index, size_t frame, vice_depth_image *out, vice_message *message) {
    float *z_m;
    size_t i;
    (void)dataset;
    if (index != 0 || frame >= FRAMES) return fail(message, "there is no such frame");
    z_m = malloc(WIDTH * HEIGHT * sizeof *z_m);
    for (i = 0; i < WIDTH * HEIGHT; ++i) z_m[i] = i % 3 == 0 ? NAN : 1.0f;
    out->stamp_ns = stamp(frame);
    out->width_px = WIDTH;
    out->height_px = HEIGHT;
    out->z_m = z_m;
    out->data_bytes = WIDTH * HEIGHT * sizeof *z_m;
    out->row_stride_bytes = WIDTH * sizeof *z_m;
    out->owner = z_m;
#if defined(ODD_DEPTH_STRIDE)
    out->row_stride_bytes += 2;
#elif defined(SHORT_DEPTH)
    out->data_bytes -= 4;
#endif
    return VICE_OK;
}

static int32_t cloud(void *dataset, vice_cloud *out, vice_message *message) {
    static const vice_point points[3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    (void)dataset;
    (void)message;
    out->kind = VICE_CLOUD_POINTS;
    out->points = points;
    out->count = 3;
    out->world_from_cloud.rotation_wxyz[0] = 1;
#if defined(BAD_CLOUD)
    out->kind = 3;
#elif defined(NO_PLY)
    out->kind = VICE_CLOUD_PLY;
#endif
    return VICE_OK;
}

static int32_t floor_at(void *dataset, int64_t at, vice_floor *out, vice_message *message) {
    (void)dataset;
    (void)message;
    (void)at;
    out->frame = VICE_FLOOR_WORLD;
    out->normal[2] = 1;
#if defined(NO_NORMAL)
    out->normal[2] = 0;
#elif defined(BAD_FLOOR)
    out->frame = 2;
#endif
    return VICE_OK;
}

static int32_t facts(void *dataset, vice_facts *out, vice_message *message) {
    static vice_fact fact;
    (void)dataset;
    (void)message;
    fact.section = text("notes");
    fact.text = text("a fact");
#if defined(BAD_FACT)
    fact.text = text("caf\xe9");
#endif
    out->facts = &fact;
    out->count = 1;
    the_host->log(the_host->context, VICE_LOG_WARN, text("a remark of the plugin"));
    return VICE_OK;
}

static int32_t image_file(void *dataset, size_t index, size_t frame, vice_image_file *out, vice_message *message) {
    /* A black image of 8 x 4 px. */
    static const uint8_t png[] = {
        0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a, 0x00, 0x00, 0x00, 0x0d, 0x49, 0x48, 0x44, 0x52,
        0x00, 0x00, 0x00, 0x08, 0x00, 0x00, 0x00, 0x04, 0x08, 0x00, 0x00, 0x00, 0x00, 0x96, 0xa6, 0x21,
        0x2c, 0x00, 0x00, 0x00, 0x0b, 0x49, 0x44, 0x41, 0x54, 0x78, 0xda, 0x63, 0x60, 0x20, 0x0c, 0x00,
        0x00, 0x24, 0x00, 0x01, 0x25, 0xc2, 0xa8, 0xe3, 0x00, 0x00, 0x00, 0x00, 0x49, 0x45, 0x4e, 0x44,
        0xae, 0x42, 0x60, 0x82};
    (void)dataset;
    (void)message;
#if !defined(GIVES_ALL_FILES)
    if (index != 0 || frame >= FRAMES) return fail(message, "there is no such frame");
#endif
    out->data = png;
    out->data_bytes = sizeof png;
#if defined(NULL_FILE)
    out->data = NULL;
#elif defined(HUGE_FILE)
    out->data_bytes = (size_t)-1;
#elif defined(OTHER_FILE)
    out->data = (const uint8_t *)"GIF89a";
    out->data_bytes = 6;
#elif defined(BROKEN_FILE)
    out->data_bytes = 40;
#endif
    return VICE_OK;
}

static int32_t suspicions(void *dataset, vice_suspicions *out, vice_message *message) {
    static vice_suspicion list[2];
    (void)dataset;
    (void)message;
    list[0].code = text("dark");
    list[0].about = text("cam");
    list[0].message = text("the pictures are dark");
    list[0].evidence = text("mean 1 of 255");
    list[0].advice = text("switch on the light");
    list[0].count = 3;
    list[1] = list[0];
    out->suspicions = list;
    out->count = 1;
#if defined(NO_CODE)
    list[0].code = text("");
#elif defined(BAD_CODE)
    list[0].code = text("So Dark");
#elif defined(BAD_SUSPICION)
    list[0].message = text("caf\xe9");
#elif defined(NEVER_SEEN)
    list[0].count = 0;
#elif defined(SAID_TWICE)
    out->count = 2;
#elif defined(MANY_SUSPICIONS)
    out->count = (size_t)-1 / 16;
#elif defined(NULL_SUSPICIONS)
    out->suspicions = NULL;
#endif
    return VICE_OK;
}
