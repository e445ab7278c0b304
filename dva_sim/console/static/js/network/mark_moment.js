/** Marks a moment in the story, such as a participant's remark, so that a replay can jump to it. */
import { html, useState } from '../../vendor/preact.js';
import { isOperator, maySteer } from '../store.js';
import { act } from '../net/actions.js';
import { Field } from '../ui/fields.js';

/** The panel. */
export function MarkMoment() {
  const [text, setText] = useState('');
  const [result, setResult] = useState('');
  const mark = async () => {
    const done = await act('mark', { text: text.trim() });
    setResult(done.ok ? done.text : '');
    if (done.ok) setText('');
  };
  return html`<section class="panel" aria-label="Mark">
    <h2>Mark this moment <span class="soft">a note in the story, the recording and the audit log</span></h2>
    <div class="filters"><${Field} name="Note" value=${text} most=${256} onInput=${setText} />
      <button type="button" disabled=${!maySteer.value || !isOperator.value || !text.trim()}
        onClick=${mark}>Mark</button></div>
    <p role="status" aria-label="Marked">${result}</p></section>`;
}
