// Fits of rodfit in WebAssembly: `await load(bytes)` returns a function `fit(files, name)`.

/**
 * @param {BufferSource | Response} source  the module rodfit_web.wasm, its bytes or a response with them
 * @returns {Promise<(files: Map<string, Uint8Array>, name: string) => {solved?: {text: string, report: object,
 *   page: string}, failed?: string}>} solves the fit file `name` of `files` (contents by file name)
 */
export async function load(source) {
  const bytes = source instanceof Response ? await source.arrayBuffer() : source;
  const module = await WebAssembly.compile(bytes);
  // Clocks and dates of the charts' library, which pages of fits do not use.
  const imports = {};
  for (const { module: from, name } of WebAssembly.Module.imports(module)) {
    (imports[from] ??= {})[name] = () => { throw new Error(`${name} is not available`); };
  }
  return (files, name) => {
    // A new instance for each fit: one that failed by a panic cannot be used again.
    const { exports } = new WebAssembly.Instance(module, imports);
    const write = (...parts) => {
      const length = parts.reduce((sum, part) => sum + part.length, 0);
      let address = exports.reserve(length);
      for (const part of parts) {
        new Uint8Array(exports.memory.buffer, address, part.length).set(part);
        address += part.length;
      }
    };
    const encoder = new TextEncoder();
    for (const [path, content] of files) {
      const bytes = encoder.encode(path);
      write(bytes, content);
      exports.add_file(bytes.length);
    }
    write(encoder.encode(name));
    try {
      const length = exports.run_fit();
      const output = new Uint8Array(exports.memory.buffer, exports.output_address(), length);
      return JSON.parse(new TextDecoder().decode(output));
    } catch (error) {
      return { failed: `the program stopped: ${error.message}` };
    }
  };
}
