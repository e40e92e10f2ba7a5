// Solves fits beside the page, which stays responsive. Messages: {files, name} in, the output of a fit out.
import { load } from "./rodfit.js";

const ready = fetch("rodfit_web.wasm").then((response) => {
  if (!response.ok) throw new Error(`rodfit_web.wasm: ${response.status} ${response.statusText}`);
  return load(response);
});

onmessage = async ({ data: { files, name } }) => {
  try {
    const fit = await ready;
    postMessage(fit(files, name));
  } catch (error) {
    postMessage({ failed: error.message });
  }
};
