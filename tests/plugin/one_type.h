/* The plugin that has `type` alone: the end of plugins of the tests. */
static const dfm_type *const types[] = {&type};
static const dfm_plugin plugin = {sizeof(dfm_plugin), DFM_ABI, DFM_ABI_DRAFT, 1, types, NULL};

const dfm_plugin *dfm_plugin_entry(const dfm_host *host, uint32_t host_abi, uint32_t host_abi_min) {
  (void)host_abi;
  (void)host_abi_min;
  return DFM_ABI_OK(host) ? &plugin : NULL;
}
