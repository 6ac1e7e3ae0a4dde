// Node's fetch takes no path of a file; without it the module is read as one.
if (typeof process === "object") delete globalThis.fetch;
