// Files that are dropped on the page, pasted, or chosen.

/** `onFiles` gets an array of files. */
export function listenForFiles({ target, picker, onFiles }) {
  let depth = 0;
  const show = (isOver) => {
    target.hidden = !isOver;
  };
  const hasFiles = (event) => event.dataTransfer?.types.includes('Files');
  addEventListener('dragenter', (event) => {
    if (!hasFiles(event)) return;
    depth += 1;
    show(true);
  });
  addEventListener('dragleave', (event) => {
    if (!hasFiles(event)) return;
    depth = Math.max(0, depth - 1);
    show(depth > 0);
  });
  addEventListener('dragover', (event) => {
    if (hasFiles(event)) event.preventDefault();
  });
  addEventListener('drop', (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    depth = 0;
    show(false);
    onFiles([...event.dataTransfer.files]);
  });
  addEventListener('paste', (event) => {
    const files = [...(event.clipboardData?.files ?? [])];
    if (files.length > 0) onFiles(files);
  });
  picker.addEventListener('change', () => {
    onFiles([...picker.files]);
    // The same file may be chosen again.
    picker.value = '';
  });
}
